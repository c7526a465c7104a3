"""Planar and point-mass platforms against closed forms, from statics to calibration."""

from __future__ import annotations

from dataclasses import replace
from math import cos, hypot, sin, sqrt
from pathlib import Path

import numpy as np
import pytest

from small_robots import FRAME, PLATE, RADIUS, RATIO, planar, small_robot
from winchkit.arrays import Array
from winchkit.diagnosis.diagnose import diagnose
from winchkit.errors import UsageError
from winchkit.robot import ForceLimits, Pose, calibrate, quadratic, rotation_of
from winchkit.robot.calibration.calibrate import equations_of
from winchkit.robot.calibration.identifiability import refuse_unfit
from winchkit.robot.calibration.options import Options
from winchkit.robot.diagnosis.compare import compared
from winchkit.robot.dynamics.dynamics import accelerations
from winchkit.robot.files.poses import MeasuredPoses, read_poses
from winchkit.runs import read_run
from winchkit.schema.profiles.robot import COORDINATES, PlatformSpec, Point
from winchkit.units import GRAVITY


def flat_length(exit_point: Array, anchor: Array, x: float, z: float, pitch: float) -> float:
    """Of a cable in the plane of x and z; a positive pitch turns z to x."""
    a, b = anchor[0], anchor[2]
    return hypot(
        x + a * cos(pitch) + b * sin(pitch) - exit_point[0],
        z - a * sin(pitch) + b * cos(pitch) - exit_point[2],
    )


def test_lengths_and_forces_of_three_planar_cables_are_those_of_plane_statics() -> None:
    robot = small_robot(FRAME[1:], PLATE[1:], ("x", "z", "pitch"), center_of_mass=(0.03, 0.0, 0.02))
    x, z, pitch = 0.2, 0.9, 0.25
    pose = Pose(np.array([[x, 0.0, z]]), rotation_of(0.0, pitch, 0.0)[None])
    columns, there = [], []
    for exit_point, anchor in zip(FRAME[1:], PLATE[1:], strict=True):
        arm = rotation_of(0.0, pitch, 0.0) @ anchor
        pull = np.array(exit_point) - [x, 0.0, z] - arm
        there.append(float(np.linalg.norm(pull)))
        ux, uz = pull[0] / there[-1], pull[2] / there[-1]
        columns.append([ux, uz, arm[2] * ux - arm[0] * uz])
    weight = 4.0 * GRAVITY
    lever = 0.03 * cos(pitch) + 0.02 * sin(pitch)
    balance = np.linalg.solve(np.array(columns).T, [0.0, weight, -lever * weight])
    assert robot.lengths(pose)[0] == pytest.approx(there)
    assert robot.weight(pose)[0] == pytest.approx([0, 0, -weight, 0, lever * weight, 0])
    found = quadratic(robot.structure(pose)[0], robot.weight(pose)[0], ForceLimits(-1e3, 1e3))
    assert found.feasible
    assert found.value == pytest.approx(balance)


def test_three_cables_determine_a_point_mass_by_trilateration() -> None:
    exits = ((0.0, 0.0, 3.0), (4.0, 0.0, 3.0), (1.0, 3.0, 3.0))
    robot = small_robot(exits, [(0.0, 0.0, 0.0)] * 3, ("x", "y", "z"), home=(1.5, 1.0, 1.0))
    assert not robot.hangs
    x, y, drop = 1.7, 0.6, 2.3
    given = [hypot(x - a, y - b, drop) for a, b, _ in exits]
    angles = (robot.home_length - given) / RADIUS * RATIO
    found = robot.poses_at(angles)
    assert found.converged.all()
    assert found.pose.position[0] == pytest.approx([x, y, 3.0 - drop])
    assert found.pose.rotation[0] == pytest.approx(np.eye(3))


def test_planar_poses_are_found_from_far_and_stay_in_the_plane() -> None:
    robot, rng = planar(), np.random.default_rng(1)
    many = 200
    place = np.column_stack([rng.uniform(-1, 1, many), np.zeros(many), rng.uniform(0.4, 1.6, many)])
    pose = Pose(place, rotation_of(0.0 * place[:, 0], rng.uniform(-0.4, 0.4, many), 0.0))
    found = robot.poses_at(robot.motor_angles(pose))
    assert found.converged.all()
    np.testing.assert_allclose(found.pose.position, place, atol=1e-9)
    np.testing.assert_allclose(found.pose.rotation, pose.rotation, atol=1e-9)


def test_guides_take_the_accelerations_across_them() -> None:
    robot = planar()
    wrench = np.array([[1.0, 7.0, 40.0, 5.0, 0.2, 3.0]])
    found = accelerations(robot.platform, np.eye(3)[None], np.zeros((1, 6)), wrench)[0]
    assert found == pytest.approx([1 / 4, 0, 40 / 4 - GRAVITY, 0, 0.2 / 0.04, 0])


@pytest.mark.parametrize(
    ("names", "sound"),
    [
        (COORDINATES, True),
        (("x", "z", "pitch"), True),
        (("x", "y", "z", "yaw"), True),
        (("x",), True),
        (("x", "z", "yaw"), False),
        (("y", "pitch"), False),
        (("x", "y", "z", "roll", "pitch"), False),
        (("roll", "pitch", "yaw"), False),
        ((), False),
        (("x", "x"), False),
    ],
)
def test_degrees_of_freedom_are_a_group_of_motions(names: tuple[str, ...], sound: bool) -> None:
    faults = list(PlatformSpec(degrees_of_freedom=names).rules())  # type: ignore[arg-type]
    assert (not faults) == sound


def recorded(path: Path, second: Point | None = None) -> Path:
    """Poses of a planar robot whose points are some millimetres from the profile's.

    ``second``: of the second exit point alone, m.
    """
    rng = np.random.default_rng(8)
    offset = rng.normal(0, 4e-3, (2, 4, 3)) * [1, 0, 1]
    if second is not None:
        offset[:] = 0.0
        offset[0, 1] = second
    exits, anchors = np.array(FRAME) + offset[0], np.array(PLATE) + offset[1]
    home = [flat_length(e, b, 0.0, 1.0, 0.0) for e, b in zip(exits, anchors, strict=True)]
    lines = [
        ",".join(
            [
                *(f"{n}.motor_angle [rad]" for n in "1234"),
                *(f"platform_{a} [m]" for a in "xyz"),
                *(f"platform_{a} [rad]" for a in ("roll", "pitch", "yaw")),
            ]
        )
    ]
    for x, z, pitch in rng.uniform([-0.7, 0.5, -0.3], [0.7, 1.5, 0.3], (50, 3)).tolist():
        there = [flat_length(e, b, x, z, pitch) for e, b in zip(exits, anchors, strict=True)]
        motor = (np.array(home) - there) / RADIUS * RATIO
        seen = np.array([x, 0.0, z]) + rng.normal(0, 3e-5, 3)
        turned = np.array([0.0, pitch, 0.0]) + rng.normal(0, 2e-4, 3)
        lines.append(",".join(f"{value:.9g}" for value in (*motor, *seen, *turned)))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_a_planar_robot_is_calibrated_in_its_plane(tmp_path: Path) -> None:
    run = read_run(recorded(tmp_path / "poses.csv"))
    robot = planar()
    errors = compared([run], robot.profile).comparison.outputs
    found = calibrate(robot, read_poses([run], robot.profile))
    assert not found.refusal
    held_out = sqrt(np.mean(found.validation_after.distance**2))
    assert held_out < 3 * 3e-5 * sqrt(3), "three times the tracker's noise"
    assert errors["platform_position"].rms > 5 * held_out
    assert not any(name.endswith("point.y") for name in found.estimates)
    z = [abs(e.value - e.nominal) / e.std for e in found.estimates.values()]
    assert max(z) > 10, "the points were some millimetres off"


def test_a_planar_robot_is_diagnosed_without_what_its_guides_hold(tmp_path: Path) -> None:
    run = read_run(recorded(tmp_path / "poses.csv", (4e-3, 0.0, -3e-3)))
    across = {"platform_y", "platform_roll", "platform_yaw"}
    flat = replace(run, channels={n: c for n, c in run.channels.items() if n not in across})
    profile = planar().profile
    assert not read_poses([flat], profile).notes
    for own in (run, flat):
        found = diagnose([own], profile).diagnosis
        (step,) = found.steps
        assert step.effects == ("exit-point/2",)
        after = found.outputs["platform_position"].heldout_rms_after
        assert after < 3 * 3e-5 * sqrt(3), "three times the tracker's noise"


def test_cables_in_a_plane_calibrate_no_platform_in_space(tmp_path: Path) -> None:
    run = read_run(recorded(tmp_path / "poses.csv"))
    profile = planar().profile
    spatial = replace(profile, platform=replace(profile.platform, degrees_of_freedom=COORDINATES))
    robot = replace(
        planar(),
        profile=spatial,
        platform=spatial.platform,
        geometry=replace(planar().geometry, free=np.ones(6)),
    )
    equations = equations_of(robot, read_poses([run], spatial), Options())
    with pytest.raises(UsageError, match=r'degrees_of_freedom = \["x", "z", "pitch"\]'):
        refuse_unfit(equations)


def test_positions_across_the_guides_are_refused(tmp_path: Path) -> None:
    robot = planar()
    poses = read_poses([read_run(recorded(tmp_path / "poses.csv"))], robot.profile)
    off: MeasuredPoses = replace(poses, position=poses.position + np.array([0.0, 0.3, 0.0]))
    with pytest.raises(UsageError, match="300 mm from home along y"):
        refuse_unfit(equations_of(robot, off, Options()))
