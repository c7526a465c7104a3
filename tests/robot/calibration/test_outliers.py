"""Gross errors of poses of an independent simulator: named and left out, and none without any."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from calibration_cases import elastic_rows, held, measured, robot, rows
from robot_poses.mistaken import Scene, recorded
from robot_poses.truth import csv
from winchkit.catalog import find
from winchkit.errors import RunError
from winchkit.model.rotation import rotation_by
from winchkit.robot import robot_of
from winchkit.robot.calibration.calibrate import calibrate, equations_of, split
from winchkit.robot.calibration.options import Options
from winchkit.robot.calibration.prediction import in_other_zeros, rms
from winchkit.robot.files.poses import MeasuredPoses
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.identification.bundle_adjustment import BundleState, Weights, place
from winchkit.robot.identification.variance_components import START
from winchkit.schema.profiles.instruments import InstrumentSpec, TrackerSpec
from winchkit.schema.read import read_robot

FRAME = rotation_by(np.array([[0.3, -0.5, 2.0]]))[0]
SHIFT = np.array([1.2, -0.7, 0.4])
SEED = 451


def set_up_anew(poses: MeasuredPoses) -> MeasuredPoses:
    """The positions in another frame."""
    return replace(poses, position=poses.position @ FRAME.T + SHIFT)


def spoilt(poses: MeasuredPoses, count: int, size: float) -> tuple[MeasuredPoses, set[str]]:
    """Some positions off by a length in random directions, and their places."""
    rng = np.random.default_rng(SEED)
    which = rng.choice(len(poses), count, replace=False)
    off = rng.normal(size=(count, 3))
    position = poses.position.copy()
    position[which] += size * off / np.linalg.norm(off, axis=1, keepdims=True)
    return replace(poses, position=position), set(poses.place[which].tolist())


@pytest.mark.slow
@pytest.mark.parametrize("known", [True, False], ids=["known frame", "unknown frame"])
@pytest.mark.parametrize(("count", "size"), [(3, 0.05), (20, 0.02), (1, 0.3)])
def test_wrong_points_are_named_and_cost_no_accuracy(count: int, size: float, known: bool) -> None:
    fit, wrong = spoilt(measured(csv(rows(90, SEED))), count, size)
    judged, own = held(), robot()
    if not known:
        fit, judged = set_up_anew(fit), set_up_anew(judged)
        unknown = InstrumentSpec(tracker=TrackerSpec(frame="unknown"))
        own = robot_of(replace(own.profile, instrument=unknown))
    found = calibrate(own, fit, judged)
    assert set(found.gross_errors) == wrong
    assert rms(found.validation_after.distance) < 4.5e-5
    assert found.weights.sigma["position"] == pytest.approx(2e-5, rel=0.25)
    assert found.refusal == ""


def test_wrong_points_are_named_where_they_are_held_out_too() -> None:
    fit, wrong = spoilt(measured(csv(rows(90, SEED))), 9, 0.03)
    kept, judged = split(fit)
    assert wrong & set(judged.place.tolist())
    found = calibrate(robot(), fit)
    assert set(found.gross_errors) == wrong
    assert len(found.validation_after.distance) < len(judged)
    assert len(found.equations.measured) < len(kept)
    assert rms(found.validation_after.distance) < 6e-5
    assert sum("gross errors" in text for text in found.warnings) == 2


def test_a_wrong_motor_angle_is_a_gross_error_as_well() -> None:
    fit = measured(csv(rows(90, SEED)))
    angle = fit.motor_angle.copy()
    angle[[7, 55], [2, 6]] += 0.3
    found = calibrate(robot(), replace(fit, motor_angle=angle), held())
    assert set(found.gross_errors) == {str(fit.place[7]), str(fit.place[55])}
    assert rms(found.validation_after.distance) < 4.5e-5


@pytest.mark.parametrize("count", [10, 15, 30, 90])
def test_poses_without_gross_errors_are_all_used(count: int) -> None:
    found = calibrate(robot(), measured(csv(rows(count, SEED))), held())
    assert found.gross_errors == ()


def test_a_pose_in_another_zero_of_the_lengths_is_no_gross_error() -> None:
    """Positions alone: from far tilts the cables of one of 40 poses close at a wrong rotation."""
    own = robot_of(read_robot(find("profiles", "winding-device-8")))
    fit = measured(recorded(Scene("winding-device-8", True, False, 40, 2e-5, 1e-3, 5)).csv())
    equations = equations_of(own, fit, Options())
    values, weights = equations.parameters.nominal, Weights(START)
    right = place(equations, BundleState(values, equations.start(values)), weights)
    tilted = rotation_by(np.tile([1.0, 1.0, 0.0], (40, 1))) @ right.pose.rotation
    wrong = place(equations, BundleState(values, Pose(right.pose.position, tilted)), weights)
    off = np.abs(wrong.pose.rotation - right.pose.rotation).max(axis=(1, 2))
    assert np.count_nonzero(off > 0.1) >= 1
    found, changed = in_other_zeros(equations, wrong, weights)
    assert changed
    assert np.abs(found.pose.rotation - right.pose.rotation).max() < 1e-6


def test_an_effect_that_the_model_lacks_makes_no_gross_errors() -> None:
    fit = measured(csv(elastic_rows(90, SEED)))
    found = calibrate(robot(), fit, measured(csv(elastic_rows(40, SEED + 1))))
    assert found.gross_errors == ()


def test_a_table_with_half_of_its_poses_wrong_is_refused() -> None:
    fit, _ = spoilt(measured(csv(rows(90, SEED))), 45, 0.02)
    with pytest.raises(RunError, match="poses-unlike"):
        calibrate(robot(), fit, held())


@pytest.mark.parametrize("known", [True, False], ids=["known frame", "unknown frame"])
def test_a_table_that_is_given_twice_counts_once(known: bool) -> None:
    table, own = csv(rows(30, SEED)), robot()
    if not known:
        unknown = InstrumentSpec(tracker=TrackerSpec(frame="unknown"))
        own = robot_of(replace(own.profile, instrument=unknown))
    twice = measured(table, table)
    assert len(twice) == 30
    assert "30 of 60 poses are copies" in " ".join(twice.notes)
    once, found = (calibrate(own, poses, held()) for poses in (measured(table), twice))
    np.testing.assert_array_equal(once.values, found.values)
    assert any("copies of other rows" in text for text in found.warnings)


def test_a_pose_that_is_fitted_is_not_held_out() -> None:
    fit = measured(csv(rows(40, SEED)))
    with pytest.raises(RunError, match="every pose for the held-out error is among those to fit"):
        calibrate(robot(), fit, fit)
    first = np.arange(len(fit)) < 20
    found = calibrate(robot(), fit[first], fit)
    assert len(found.validation_after.distance) == 20
    assert "20 of 40 poses are among those to fit, equal in every number; not held out" in (
        found.warnings
    )
