"""Poses from lengths against scipy's least squares, hanging platforms against what is in reach."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from robot_cases import near, random_geometry, shipped
from winchkit.errors import UsageError
from winchkit.model.rotation import rotation_by
from winchkit.robot import (
    Geometry,
    Pose,
    forward,
    gravity_wrench,
    lengths,
    robot_of,
    structure_matrix,
)
from winchkit.schema.profiles.robot import PlatformSpec
from winchkit.units import GRAVITY

Array = np.ndarray
seeds = st.integers(0, 10_000)
LEVEL = Pose(np.zeros((1, 3)), np.eye(3)[None])
HEAVY = PlatformSpec(12.0, (0.02, -0.01, -0.08))


def moved(pose: Pose, step: Array) -> Pose:
    return Pose(pose.position + step[:3], rotation_by(step[3:]) @ pose.rotation)


def suspended(count: int = 4) -> Geometry:
    """Cables from the corners of a frame 3 m above to the top of a platform."""
    turn = 2 * np.pi * (np.arange(count) + 0.3) / count
    ring = np.stack([np.cos(turn), np.sin(turn), np.zeros(count)], axis=1)
    return Geometry(
        2.5 * ring + [0, 0, 3.0],
        0.25 * ring + [0, 0, 0.05],
        np.full(count, 0.04),
        np.tile([0.0, 0.0, 1.0], (count, 1)),
    )


@pytest.mark.parametrize("name", ["cabtive", "ipanema3", "winding-device-8"])
def test_poses_come_back_from_their_lengths(name: str) -> None:
    robot = shipped(name)
    poses = near(robot, 1, 200)
    found = forward(robot.geometry, robot.lengths(poses), robot.home)
    assert found.converged.all()
    np.testing.assert_allclose(found.pose.position, poses.position, atol=1e-11)
    np.testing.assert_allclose(found.pose.rotation, poses.rotation, atol=1e-11)
    np.testing.assert_allclose(found.residual, 0.0, atol=1e-12)


@settings(max_examples=15, deadline=None)
@given(seeds)
def test_lengths_that_disagree_give_the_pose_of_least_squares(seed: int) -> None:
    robot = shipped("cabtive")
    poses = near(robot, seed, 1)
    given_lengths = robot.lengths(poses) + np.random.default_rng(seed).normal(0, 1e-3, (1, 8))

    def residual(step: Array) -> Array:
        return (robot.lengths(moved(poses, step)) - given_lengths)[0]

    theirs = least_squares(residual, np.zeros(6), xtol=1e-15, ftol=1e-15, gtol=1e-15)
    found = forward(robot.geometry, given_lengths, robot.home)
    expected = moved(poses, theirs.x)
    np.testing.assert_allclose(found.pose.position, expected.position, atol=1e-7)
    np.testing.assert_allclose(found.pose.rotation, expected.rotation, atol=1e-6)
    assert np.sum(found.residual**2) <= 2 * theirs.cost + 1e-15


@pytest.mark.parametrize("count", [6, 7, 12])
def test_any_number_of_cables(count: int) -> None:
    geometry = random_geometry(5, count)
    pose = Pose(np.full((1, 3), 0.02), rotation_by(np.array([[0.02, -0.01, 0.03]])))
    found = forward(geometry, lengths(geometry, pose.position, pose.rotation), LEVEL)
    np.testing.assert_allclose(found.pose.position, pose.position, atol=1e-9)


def test_a_warm_start_takes_few_steps() -> None:
    robot = shipped("cabtive")
    poses = near(robot, 2, 50)
    given_lengths = robot.lengths(poses)
    cold = forward(robot.geometry, given_lengths, robot.home)
    warm = forward(robot.geometry, given_lengths, Pose(poses.position + 2e-4, poses.rotation))
    assert warm.steps <= 4 < cold.steps


def test_what_cannot_be_found_is_nan_and_said() -> None:
    robot = shipped("cabtive")
    given_lengths = np.repeat(robot.lengths(robot.home), 3, axis=0)
    given_lengths[1, 4] = np.nan
    found = forward(robot.geometry, given_lengths, robot.home)
    assert found.converged.tolist() == [True, False, True]
    for part in (found.pose.position, found.pose.rotation, found.residual):
        assert np.isnan(part[1]).all()
        assert np.isfinite(part[[0, 2]]).all()


def test_cables_that_leave_a_degree_of_freedom_give_no_pose() -> None:
    """All anchors in one point: lengths say nothing of the rotation."""
    geometry = replace(random_geometry(6), anchor_point=np.zeros((8, 3)))
    given_lengths = lengths(geometry, np.full((1, 3), 0.1), np.eye(3)[None])
    found = forward(geometry, given_lengths, LEVEL)
    assert not found.converged.any()
    assert np.isnan(found.pose.position).all()


def heights_in_reach(
    geometry: Geometry, given_lengths: Array, rest: Pose, rng: np.random.Generator
) -> Array:
    """Heights of the centre of mass at random poses around ``rest`` that no cable forbids."""
    steps = rng.normal(size=(4000, 6)) * 10.0 ** rng.uniform(-4, -1.5, (4000, 1))
    position = rest.position + steps[:, :3]
    rotation = rotation_by(steps[:, 3:]) @ rest.rotation
    allowed = np.all(lengths(geometry, position, rotation) <= given_lengths, axis=1)
    return (position + rotation @ np.array(HEAVY.center_of_mass))[allowed, 2]


@settings(max_examples=12, deadline=None)
@example(18, 4)
@example(55, 4)
@example(7149, 5)
@given(seeds, st.sampled_from([1, 2, 3, 4, 5]))
def test_a_hanging_platform_rests_where_its_weight_is_lowest(seed: int, count: int) -> None:
    geometry = suspended(count)
    rng = np.random.default_rng(seed)
    start = Pose(np.array([[0.0, 0.0, 0.8]]), np.eye(3)[None])
    given_lengths = lengths(geometry, start.position, start.rotation) + rng.uniform(
        -0.2, 0.2, (1, count)
    )
    found = forward(geometry, given_lengths, start, HEAVY)
    assert found.converged.all()
    rotation = found.pose.rotation
    structure = structure_matrix(geometry, found.pose.position, rotation)
    balance = (structure @ found.forces[..., None])[..., 0] + gravity_wrench(HEAVY, rotation)
    np.testing.assert_allclose(balance, 0.0, atol=1e-6)
    assert np.all(found.forces >= -1e-6)
    assert np.all(found.residual >= -1e-8)
    assert np.abs(found.forces * found.residual).max() < 1e-6
    height = (found.pose.position + rotation @ np.array(HEAVY.center_of_mass))[0, 2]
    others = heights_in_reach(geometry, given_lengths, found.pose, rng)
    assert len(others) > 20
    assert others.min() > height - 1e-10


def test_three_cables_to_one_point_hold_it_and_the_platform_hangs_below() -> None:
    geometry = replace(suspended(3), anchor_point=np.zeros((3, 3)), swivel_radius=np.zeros(3))
    place = np.array([[0.2, -0.1, 1.0]])
    given_lengths = np.linalg.norm(geometry.exit_point - place, axis=1)[None]
    found = forward(
        geometry,
        given_lengths,
        Pose(place + 0.01, rotation_by(np.array([[0.3, 0.2, 0.0]]))),
        PlatformSpec(5.0, (0.0, 0.0, -0.3)),
    )
    np.testing.assert_allclose(found.pose.position, place, atol=1e-9)
    np.testing.assert_allclose(found.pose.rotation[0, :, 2], [0, 0, 1], atol=1e-6)


def test_a_free_platform_needs_its_mass() -> None:
    geometry = suspended()
    with pytest.raises(
        UsageError, match=r"4 lines leave the platform 2 degrees of freedom.*give .*mass"
    ):
        forward(geometry, np.full((1, 4), 3.0), LEVEL)
    with pytest.raises(UsageError, match="3 lengths were given for a robot of 4 lines"):
        forward(geometry, np.full((1, 3), 3.0), LEVEL, HEAVY)


def test_motor_angles_of_a_hanging_robot_lead_back() -> None:
    """A robot of four cables from a file's parts: pose at rest, motor angles, pose."""
    winch = shipped("winding-device-8").profile
    four = replace(winch, line=winch.line[::2], platform=HEAVY)
    robot = robot_of(four)
    rest = forward(robot.geometry, robot.home_length[None] + 0.1, robot.home, HEAVY)
    again = robot.poses_at(robot.motor_angles(rest.pose), robot.home)
    np.testing.assert_allclose(again.pose.position, rest.pose.position, atol=1e-7)


def test_cables_in_one_plane_leave_motions_without_curvature_where_they_are() -> None:
    """Four cables of a planar robot whose lengths contradict each other by decimetres."""
    side = np.array([[1.4, 0.0], [1.4, 2.4], [-1.4, 2.4], [-1.4, 0.0]])
    corner = np.array([[0.09, -0.06], [0.09, 0.06], [-0.09, 0.06], [-0.09, -0.06]])
    flat = Geometry(
        np.stack([side[:, 0], np.zeros(4), side[:, 1]], axis=1),
        np.stack([corner[:, 0], np.zeros(4), corner[:, 1]], axis=1),
        np.zeros(4),
        np.tile([0.0, 1.0, 0.0], (4, 1)),
    )
    start = Pose(np.array([[0.08, 0.0, 1.2]]), np.eye(3)[None])
    wrong = np.array([[1.255, 1.94, 2.146, 1.736], [2.048, 1.876, 1.129, 1.348]])
    found = forward(flat, wrong, start, PlatformSpec(1.0))
    assert np.all(np.isfinite(found.pose.position[found.converged]))


@pytest.mark.parametrize("sign", [1.0, -1.0, 0.0])
def test_a_level_platform_whose_lengths_are_a_micrometre_inconsistent_is_found(sign: float) -> None:
    """On four cables in two planes of symmetry no motion changes one sum of the lengths."""
    robot = shipped("hanging-4")
    place = np.array([0.0, 0.0, 0.85])
    there = lengths(robot.geometry, place[None], np.eye(3)[None])
    off = sign * 2e-6 * np.array([1.0, -1.0, 1.0, -1.0])
    found = forward(robot.geometry, there + off, robot.home, robot.platform)
    assert found.converged.all()
    assert found.pose.position[0] == pytest.approx(place, abs=1e-5)
    assert np.abs(found.residual).max() < 1e-5
    weight = robot.platform.mass * GRAVITY
    assert found.forces[0].sum() > weight, "they lean"
