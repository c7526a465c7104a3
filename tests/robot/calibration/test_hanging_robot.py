"""A hanging robot of four cables: poses of lowest potential energy, from another program."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from math import pi

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.optimize import brentq, minimize

from calibration_cases import robot
from robot_poses.truth import GRAVITY, HOME, Truth, turn
from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.robot import Pose, Robot, lengths, robot_of, rotation_of
from winchkit.robot.calibration import pose_design as robot_next
from winchkit.robot.calibration.calibrate import Calibrated, calibrate, split
from winchkit.robot.calibration.options import Options
from winchkit.robot.calibration.outliers import unexplained
from winchkit.robot.calibration.prediction import rms
from winchkit.robot.files.poses import MeasuredPoses
from winchkit.robot.forces.balance import (
    hanging_balance,
    hanging_residual,
    resting_balance,
    wrench_scale,
)
from winchkit.robot.geometry.pose_estimation import moved_pose
from winchkit.robot.mistakes.search import mistakes_in
from winchkit.schema.profiles.robot import PriorSpec
from winchkit.schema.profiles.winch import WinchProfile

CENTRE = np.array([0.0, 0.0, -0.05])
ROPES, COUNT = 4, 60
TRACKER, ENCODER, ANGLE = 2e-5, 1e-4, 1e-3


@cache
def truth() -> Truth:
    """The upper cables of the paper's robot, led to points above its platform."""
    whole = Truth()
    anchor = tuple((x, y, 0.0635 + 0.002 * i) for i, (x, y, _) in enumerate(whole.anchor[:ROPES]))
    return replace(whole, exit=whole.exit[:ROPES], anchor=anchor)


def ropes(pose: Array) -> Array:
    x, y, z, *angles = pose.tolist()
    turned = turn(*angles)
    return np.array([truth().length(i, (x, y, z), turned) for i in range(ROPES)])


def height(pose: Array) -> float:
    """Of the centre of mass."""
    return float(pose[2] + (np.array(turn(*pose[3:].tolist())) @ CENTRE)[2])


def rest(given: Array, start: Array) -> Array:
    """The pose of the lowest weight with cables of these lengths."""
    found = minimize(
        height,
        start,
        method="SLSQP",
        constraints={"type": "eq", "fun": lambda pose: ropes(pose) - given},
        options={"ftol": 1e-14, "maxiter": 500},
    )
    assert np.max(np.abs(ropes(found.x) - given)) < 1e-9
    return np.asarray(found.x)


def wound_in(line: int, shorter: float) -> float:
    """Drum angle since home at which the cable is that much shorter."""
    begin = 2 * pi * truth().turns
    at_home = truth().wound(line, begin)
    return float(brentq(lambda a: truth().wound(line, begin + a) - at_home - shorter, -20, 20))


def at_rest(rng: np.random.Generator, count: int, reach: float) -> tuple[Array, Array, Array]:
    """The home pose, poses at rest about it, and the motor angles there."""
    home = rest(ropes(np.array([*HOME, 0, 0, 0])), np.array([*HOME, 0, 0, 0]))
    poses = []
    for _ in range(count):
        about = home + np.concatenate([rng.uniform(-reach, reach, 3), np.zeros(3)])
        poses.append(rest(ropes(about) + rng.uniform(-0.012, 0.012, ROPES), about))
    shorter = ropes(home) - np.array([ropes(pose) for pose in poses])
    motor = np.array([[wound_in(i, s) for i, s in enumerate(row)] for row in shorter.tolist()])
    return home, np.array(poses), motor


@cache
def hanging() -> tuple[Robot, MeasuredPoses]:
    """The nominal robot, and measurements of the true one."""
    rng = np.random.default_rng(3)
    home, seen, motor = at_rest(rng, COUNT, 0.1)
    nothing = np.full((COUNT, ROPES), np.nan)
    measured = MeasuredPoses(
        motor_angle=motor + rng.normal(0, ENCODER, motor.shape),
        position=seen[:, :3] + rng.normal(0, TRACKER, (COUNT, 3)),
        angles=seen[:, 3:] + rng.normal(0, ANGLE, (COUNT, 3)),
        swivel=nothing,
        cable_length=nothing,
        tension=nothing,
        temperature=nothing,
        run=np.zeros(COUNT, dtype=np.intp),
        place=np.array([f"row {n + 1}" for n in range(COUNT)]),
    )
    return believed(home), measured


def believed(home: Array) -> Robot:
    """The profile's own points, the anchors a few millimetres off, and the pose measured first."""
    profile = robot().profile
    lines = tuple(
        replace(line, anchor_point=(line.anchor_point[0], line.anchor_point[1], 0.066))
        for line in profile.line[:ROPES]
    )
    place, angles = (tuple(part.tolist()) for part in (home[:3], home[3:]))
    return robot_of(
        replace(
            profile,
            line=lines,
            home=replace(profile.home, position=place, rotation=angles),
            platform=replace(profile.platform, center_of_mass=tuple(CENTRE.tolist())),
        )
    )


@pytest.mark.slow
@pytest.mark.parametrize("rotations", [pytest.param(True, marks=pytest.mark.campaign), False])
def test_a_robot_that_hangs_is_calibrated_and_predicted(rotations: bool) -> None:
    believed, measured = hanging()
    if not rotations:
        measured = replace(measured, angles=np.full_like(measured.angles, np.nan))
    fit, held = split(measured)
    found = calibrate(believed, fit, held)
    assert found.solution.converged
    assert found.observed.free == 33
    assert found.validation_after.unfound == 0
    before, after = rms(found.validation_before.distance), rms(found.validation_after.distance)
    assert before > 2e-3
    assert after < before / (10 if rotations else 3)


def test_positions_alone_determine_a_robot_whose_weight_is_known() -> None:
    """Without rotations and forces, no forces of the cables may be at odds with the weight."""
    own, measured = hanging()
    own = robot_of(replace(own.profile, platform=replace(own.profile.platform, mass=MASS)))
    fit, held = split(replace(measured, angles=np.full_like(measured.angles, np.nan)))
    found = calibrate(own, fit, held)
    assert found.equations.rests
    assert rms(found.validation_after.distance) < 1e-4
    assert found.refusal == ""


def test_no_force_is_left_of_a_platform_at_rest() -> None:
    """Two rows of a platform on four cables, against the measured poses at rest."""
    own, _ = hanging()
    rng = np.random.default_rng(4)
    _, seen, _ = at_rest(rng, 5, 0.1)
    geometry = replace(
        own.geometry,
        exit_point=np.array(truth().exit),
        anchor_point=np.array(truth().anchor),
        swivel_radius=np.array(truth().swivel[:ROPES]),
    )
    platform = replace(own.platform, mass=MASS, center_of_mass=tuple(CENTRE.tolist()))
    pose = Pose(seen[:, :3], rotation_of(*seen[:, 3:].T))
    found = resting_balance(geometry, pose, platform)
    assert found.residual.shape == (5, 2)
    assert np.max(np.abs(found.residual)) < 1e-4
    tilted = moved_pose(pose, np.tile([0, 0, 0, 0.01, 0.02, 0], (5, 1)))
    found = resting_balance(geometry, tilted, platform)
    assert np.min(np.max(np.abs(found.residual), axis=1)) > 0.5
    for index in range(6):
        step = np.zeros((5, 6))
        step[:, index] = 1e-5
        # The rows are a basis; their sum of squares does not depend on which.
        moved = [moved_pose(tilted, by) for by in (step, -step)]
        high, low = (resting_balance(geometry, at, platform).residual for at in moved)
        expected = 2 * np.sum(found.residual * found.by_pose[..., index], axis=1)
        slope = np.sum(high**2 - low**2, axis=1) / 2e-5
        np.testing.assert_allclose(slope, expected, atol=1e-3)


def test_lengths_at_home_of_a_hanging_robot_are_tried() -> None:
    """One cable 100 mm off, which no other contradicts: the rotations do."""
    believed, measured = hanging()
    motor = measured.motor_angle + np.array([wound_in(0, 0.1), 0, 0, 0])
    fit, held = split(replace(measured, motor_angle=motor))
    found = calibrate(believed, fit, held)
    assert "home_length" in found.equations.parameters.block
    assert rms(found.validation_after.distance) < 5e-4


def test_proposed_poses_are_such_that_it_rests_there() -> None:
    """No motion that keeps the cables' lengths moves the centre of mass up or down."""
    believed, measured = hanging()
    fit, held = split(measured)
    found = calibrate(believed, fit, held)
    geometry = found.equations.geometry(found.values)
    proposed = robot_next.next_poses(found, 3)
    assert len(proposed) == 3
    for pose in proposed:
        at = np.array([*pose.position, *pose.angles])

        def given(x: Array) -> Array:
            return lengths(geometry, x[None, :3], rotation_of(*x[3:, None]))[0]

        steps = np.eye(6) * 1e-6
        slope = np.array([(given(at + d) - given(at - d)) / 2e-6 for d in steps])
        rise = np.array([(height(at + d) - height(at - d)) / 2e-6 for d in steps])
        free = null_space(slope.T)
        assert free.shape == (6, 2)
        np.testing.assert_allclose(free.T @ rise, 0.0, atol=1e-6)


@pytest.mark.parametrize("rotations", [True, False])
def test_mistakes_of_a_hanging_robot_are_named(rotations: bool) -> None:
    """Where its weight leaves the platform at each pose, contradicts the positions."""
    believed, measured = hanging()
    measured = measured[np.arange(COUNT) < COUNT // 2]
    if not rotations:
        measured = replace(measured, angles=np.full_like(measured.angles, np.nan))
    motor = measured.motor_angle
    for wrong, code in (
        (motor, []),
        (motor[:, [0, 2, 1, 3]], ["motor-columns:2-3"]),
        (motor * [1, 1, 1, -1], ["motor-sign:4"]),
        (np.degrees(motor), ["motor-unit:deg"]),
        (np.roll(motor, 1, axis=0), ["rows:1"]),
    ):
        found = mistakes_in(believed, replace(measured, motor_angle=wrong))
        assert [named.code for named in found] == code


MASS = 3.0


def forces(pose: Array) -> Array:
    """Cable forces at rest by virtual work: a cable that gets longer pulls back with its force."""
    ends = [(pose + step, pose - step) for step in np.eye(6) * 1e-6]
    slope = np.array([(ropes(a) - ropes(b)) / 2e-6 for a, b in ends])
    rise = np.array([(height(a) - height(b)) / 2e-6 for a, b in ends])
    found, _, _, _ = np.linalg.lstsq(slope, -MASS * GRAVITY * rise, rcond=None)
    assert np.max(np.abs(slope @ found + MASS * GRAVITY * rise)) < 1e-4
    return np.asarray(found)


def without_tracker(count: int, seed: int) -> tuple[Robot, MeasuredPoses]:
    """The true robot, and swivels, cells and roll and pitch of an IMU at poses at rest."""
    rng = np.random.default_rng(seed)
    home, poses, motor = at_rest(rng, count, 0.12)
    swivel = np.array([[swivel_of(pose, i) + 0.3 * i - 1 for i in range(ROPES)] for pose in poses])
    pull = np.array([forces(pose) for pose in poses])
    angles = poses[:, 3:] + rng.normal(0, 5e-4, (count, 3))
    angles[:, 2] = np.nan
    nothing = np.full((count, ROPES), np.nan)
    measured = MeasuredPoses(
        motor_angle=motor + rng.normal(0, ENCODER, motor.shape),
        position=np.full((count, 3), np.nan),
        angles=angles,
        swivel=swivel + rng.normal(0, ANGLE, swivel.shape),
        cable_length=nothing,
        tension=pull + rng.normal(0, 0.05, pull.shape),
        temperature=nothing,
        run=np.zeros(count, dtype=np.intp),
        place=np.array([f"row {n + 1}" for n in range(count)]),
    )
    profile, own = believed(home).profile, truth()
    lines = tuple(
        replace(line, exit_point=own.exit[i], anchor_point=own.anchor[i])
        for i, line in enumerate(profile.line)
    )
    drums = []
    for i, line in enumerate(lines):
        assert isinstance(line.winch, WinchProfile)
        drum = replace(line.winch.drum, winding_radius=own.winding[i], layer_growth=own.growth)
        drums.append(
            replace(line, swivel_radius=own.swivel[i], winch=replace(line.winch, drum=drum))
        )
    platform = replace(profile.platform, mass=MASS)
    return robot_of(replace(profile, line=tuple(drums), platform=platform, prior={})), measured


def swivel_of(pose: Array, line: int) -> float:
    x, y, z, *angles = pose.tolist()
    arm = np.array(turn(*angles)) @ np.array(truth().anchor[line])
    seen = np.array([x, y, z]) + arm - np.array(truth().exit[line])
    return float(np.arctan2(seen[1], seen[0]))


def test_the_equilibrium_has_the_derivatives_of_its_residual() -> None:
    nominal, measured = without_tracker(3, 7)
    rng = np.random.default_rng(1)
    pose = Pose(HOME + rng.normal(0, 0.05, (3, 3)), rotation_of(*rng.normal(0, 0.05, (3, 3))))
    platform = nominal.platform
    found = hanging_balance(nominal.geometry, pose, measured.tension, platform)
    step = 1e-4 * rng.normal(size=(3, 6))
    there = hanging_balance(nominal.geometry, moved_pose(pose, step), measured.tension, platform)
    back = hanging_balance(nominal.geometry, moved_pose(pose, -step), measured.tension, platform)
    change = (there.residual - back.residual) / 2
    np.testing.assert_allclose((found.by_pose @ step[..., None])[..., 0], change, atol=1e-6)
    geometry = nominal.geometry
    for name in ("exit_point", "anchor_point", "swivel_radius"):
        move = 1e-5 * rng.normal(size=getattr(geometry, name).shape)
        ends = []
        for sign in (1.0, -1.0):
            moved = replace(geometry, **{name: getattr(geometry, name) + sign * move})
            left = hanging_residual(moved, pose, measured.tension, platform)
            ends.append(left / wrench_scale(moved))
        change = wrench_scale(geometry) * (ends[0] - ends[1]) / 2
        np.testing.assert_allclose(found.by_robot[name] @ move.ravel(), change, atol=1e-7)


def test_motor_angles_alone_are_not_enough_for_four_cables() -> None:
    believed, measured = hanging()
    blind = replace(
        measured,
        position=np.full_like(measured.position, np.nan),
        angles=np.full_like(measured.angles, np.nan),
    )
    with pytest.raises(UsageError, match="measure more at each"):
        calibrate(believed, blind)


@pytest.mark.slow
@pytest.mark.campaign
def test_a_fit_to_inverted_swivel_encoders_is_refused() -> None:
    """As the directions of the pulleys of a real robot were: a noise of 20 degrees was fitted."""
    nominal, measured = without_tracker(14, 7)
    found = calibrate(nominal, *split(replace(measured, swivel=-measured.swivel)))
    assert "not calibrated: the swivel angles do not follow the geometry" in found.refusal
    assert "swivel_axis" in found.refusal


@cache
def with_unknown_home() -> tuple[Robot, Array, Calibrated]:
    """A robot that is switched on anywhere, the change of its lengths to there, and its fit."""
    nominal, measured = without_tracker(30, 8)
    profile, away = nominal.profile, np.array([0.03, -0.03, 0.03])
    declared = np.array(profile.home.position) + away
    x, y, z = declared.tolist()
    unknown = replace(
        profile,
        home=replace(profile.home, position=(x, y, z)),
        prior={"home_length": PriorSpec(0.1), "exit_point": PriorSpec(1e-3)},
    )
    found = calibrate(robot_of(unknown), *split(measured), Options(effects=("home-length",)))
    home = np.array([*profile.home.position, *profile.home.rotation])
    return nominal, ropes(home) - ropes(np.array([x, y, z, *profile.home.rotation])), found


@pytest.mark.slow
def test_swivel_encoders_against_a_geometry_that_they_do_not_follow_are_refused() -> None:
    """The whole fit to such encoders is a campaign; reversed axes are in test_swivel_axes.py."""
    found = with_unknown_home()[2]
    measured = found.equations.measured
    assert not list(unexplained(found.equations, found.solution))
    inverted = replace(found.equations, measured=replace(measured, swivel=-measured.swivel))
    refused = replace(found, unexplained=tuple(unexplained(inverted, found.solution))).refusal
    assert "not calibrated: the swivel angles do not follow the geometry" in refused
    assert "swivel_axis" in refused


@pytest.mark.slow
def test_an_unknown_home_pose_is_estimated_by_the_lengths_there() -> None:
    """Its home is declared 50 mm beside the true one."""
    nominal, moved, found = with_unknown_home()
    lengths_there = [found.estimates[f"{line}.home_length"] for line in nominal.names]
    assert np.max(np.abs(moved)) > 0.02
    assert [item.value for item in lengths_there] == pytest.approx(moved.tolist(), abs=3e-3)
    before, after = found.validation_lengths
    assert after < 0.2 * before
