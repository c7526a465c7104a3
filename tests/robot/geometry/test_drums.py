"""Poses to motor angles and back, for every winding law, in batches and in a control cycle."""

from __future__ import annotations

from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest

from robot_cases import near, shipped
from winchkit.errors import UsageError
from winchkit.robot import (
    PLAIN,
    Pose,
    Robot,
    RobotCycle,
    RobotKernels,
    compiled,
    fastest,
    flat_pose,
    robot_of,
)
from winchkit.schema.profiles.winch import DrumSpec

Array = np.ndarray
DRUMS = {
    "spiral": DrumSpec("spiral", 0.06, layer_growth=0.48e-3),
    "archimedean": DrumSpec("archimedean", 0.06, layer_growth=0.48e-3),
    "grooved": DrumSpec("grooved", 0.06, groove_pitch=5e-3),
    "squared": DrumSpec("squared", 0.06, build_up=0.02e-3),
}


def with_drum(kind: str, turns: float = 4.0) -> Robot:
    """The CABTIVE robot on other drums, every second winch turned round and geared."""
    profile = shipped("cabtive").profile
    lines = []
    for n, (line, winch) in enumerate(zip(profile.line, shipped("cabtive").winches, strict=True)):
        gearbox = replace(winch.gearbox, ratio=1.0 + n, direction=(1, -1)[n % 2])
        reference = replace(winch.reference, motor_angle=0.3 * n, wound_turns=turns)
        changed = replace(winch, drum=DRUMS[kind], gearbox=gearbox, reference=reference)
        lines.append(replace(line, winch=changed))
    return robot_of(replace(profile, line=tuple(lines)))


def radius_at(kind: str, wound_angle: Array) -> Array:
    """What the drum's radius is while it winds, from each law's own words."""
    wound_turns = np.maximum(wound_angle / (2 * np.pi), 0.0)
    match kind:
        case "spiral":
            return 0.06 + 0.48e-3 * np.floor(wound_turns)
        case "archimedean":
            return 0.06 + 0.48e-3 * wound_turns
        case "grooved":
            return np.full_like(wound_turns, np.hypot(0.06, 5e-3 / (2 * np.pi)))
    # r² = r0² + k L and dL = r dΦ make r grow by k/2 a radian.
    return 0.06 + 0.02e-3 / 2 * 2 * np.pi * wound_turns


@pytest.mark.parametrize("kind", DRUMS)
def test_cable_wound_is_the_integral_of_the_radius(kind: str) -> None:
    robot = with_drum(kind)
    poses = near(robot, 1, 6, 0.3)
    angles, lengths = robot.motor_angles(poses), robot.lengths(poses)
    for p in range(6):
        for i in range(8):
            turned = (angles[p, i] - 0.3 * i) / ((1 + i) * (1, -1)[i % 2])
            path = 8 * np.pi + turned * (np.arange(40_000) + 0.5) / 40_000
            wound = np.mean(radius_at(kind, path)) * turned
            assert robot.home_length[i] - wound == pytest.approx(lengths[p, i], abs=1e-7)


@pytest.mark.parametrize("kind", DRUMS)
@pytest.mark.parametrize("turns", [0.2, 4.0])
def test_motor_angles_and_back(kind: str, turns: float) -> None:
    """With 0.2 turns at home some cables are paid out past the bare drum."""
    robot = with_drum(kind, turns)
    poses = near(robot, 2, 50, 0.3)
    angles = robot.motor_angles(poses)
    np.testing.assert_allclose(robot.lengths_at(angles), robot.lengths(poses), atol=1e-12)
    found = robot.poses_at(angles)
    assert found.converged.all()
    np.testing.assert_allclose(found.pose.position, poses.position, atol=1e-10)


def test_home_is_the_reference() -> None:
    robot = with_drum("spiral")
    np.testing.assert_allclose(robot.motor_angles(robot.home)[0], 0.3 * np.arange(8), atol=1e-12)


def test_a_cable_that_stretches_is_wound_in_by_its_elongation() -> None:
    robot = shipped("ipanema3")
    poses = near(robot, 3, 4)
    strain = np.linspace(1e-4, 1e-3, 8)
    lengths = robot.lengths(poses)
    unstretched = robot.lengths_at(robot.motor_angles(poses, strain))
    np.testing.assert_allclose(lengths - unstretched, strain * (lengths + 5.0), atol=1e-12)


def test_the_number_of_motor_angles_is_that_of_lines() -> None:
    with pytest.raises(UsageError, match=r"7 motor angles .* a robot of 8 lines"):
        shipped("cabtive").lengths_at(np.zeros((1, 7)))


def test_a_winch_that_is_only_a_name_cannot_be_computed_with() -> None:
    profile = shipped("cabtive").profile
    named = replace(profile, line=(replace(profile.line[0], winch="other"), *profile.line[1:]))
    with pytest.raises(UsageError, match="line 1: winch 'other' has not been read"):
        robot_of(named).motor_angles(shipped("cabtive").home)


@pytest.fixture(scope="module")
def numba_kernels() -> RobotKernels:
    pytest.importorskip("numba")
    return compiled()


@pytest.fixture(params=["plain", pytest.param("numba", marks=pytest.mark.slow)])
def kernels(request: pytest.FixtureRequest) -> RobotKernels:
    return PLAIN if request.param == "plain" else request.getfixturevalue("numba_kernels")


@pytest.mark.parametrize("kind", DRUMS)
@pytest.mark.parametrize("turns", [0.2, 4.0])
def test_the_cycle_is_the_batch(kernels: RobotKernels, kind: str, turns: float) -> None:
    robot = with_drum(kind, turns)
    poses = near(robot, 4, 20, 0.3)
    cycle, strain = RobotCycle(robot, kernels), np.linspace(0, 1e-3, 8)
    held = kernels.array(strain.tolist())
    expected, straight = robot.motor_angles(poses, strain), robot.motor_angles(poses)
    lengths = robot.lengths(poses)
    for p in range(20):
        pose = kernels.array(flat_pose(poses[p : p + 1]))
        np.testing.assert_allclose(cycle.motor_angles(pose), straight[p], atol=1e-10)
        np.testing.assert_allclose(cycle.motor_angles(pose, held), expected[p], atol=1e-10)
        found = cycle.pose_at(kernels.array(lengths[p].tolist()))
        np.testing.assert_allclose(found, pose, atol=1e-8)


def test_a_long_motion_keeps_the_rotation_a_rotation(kernels: RobotKernels) -> None:
    robot = shipped("cabtive")
    time = np.linspace(0, 40, 2000)
    swing = 0.1 * np.stack([np.sin(time), np.cos(1.3 * time) - 1, np.sin(0.7 * time)], axis=1)
    poses = Pose(robot.home.position + swing, np.tile(np.eye(3), (2000, 1, 1)))
    cycle = RobotCycle(robot, kernels)
    for lengths in robot.lengths(poses):
        found = cycle.pose_at(kernels.array(lengths.tolist()))
    rotation = np.array(found[3:]).reshape(3, 3)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(found[:3], poses.position[-1], atol=1e-8)


def test_a_search_that_fails_keeps_the_last_pose(kernels: RobotKernels) -> None:
    robot = shipped("cabtive")
    cycle = RobotCycle(robot, kernels)
    home = kernels.array(robot.home_length.tolist())
    before = [float(x) for x in cycle.pose_at(home)]
    assert cycle.pose_at(kernels.array([float("nan")] * 8)) is None
    np.testing.assert_allclose(cycle.pose_at(home), before, atol=1e-12)


def test_start_from_chooses_among_assemblies() -> None:
    robot = shipped("cabtive")
    poses = near(robot, 6, 1, 0.2, 0.2)
    cycle = RobotCycle(robot)
    cycle.start_from(flat_pose(poses))
    found = cycle.pose_at(robot.lengths(poses)[0].tolist())
    np.testing.assert_allclose(found, flat_pose(poses), atol=1e-12)


def test_an_anchor_inside_its_pulley_has_no_motor_angle() -> None:
    robot = shipped("cabtive")
    inside = Pose(
        robot.geometry.exit_point[:1] - robot.geometry.anchor_point[0] + [8e-3, 0, 0],
        np.eye(3)[None],
    )
    angles = RobotCycle(robot).motor_angles(flat_pose(inside))
    assert np.isnan(angles[0])
    assert np.isfinite(angles[1:]).all()
    assert np.isnan(robot.motor_angles(inside)[0, 0])


def test_a_hanging_robot_has_motor_angles_but_no_pose_in_the_cycle() -> None:
    profile = shipped("cabtive").profile
    robot = robot_of(replace(profile, line=profile.line[:4]))
    cycle = RobotCycle(robot)
    np.testing.assert_allclose(cycle.motor_angles(flat_pose(robot.home)), 0.0, atol=1e-12)
    with pytest.raises(UsageError, match="4 lines do not constrain"):
        cycle.pose_at(robot.home_length.tolist())


@pytest.mark.skipif(find_spec("numba") is not None, reason="with numba there is more")
def test_without_numba_plain_loops_are_the_fastest_and_compiling_says_what_to_do() -> None:
    assert fastest() is PLAIN
    with pytest.raises(UsageError, match=r"pip install 'winchkit\[fast\]'"):
        compiled()
