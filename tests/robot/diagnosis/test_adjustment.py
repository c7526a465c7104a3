"""Joint estimate of poses and geometry: its derivatives, and that a calibration gives the same."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calibration_cases import held, measured, robot, rows
from robot_poses.truth import csv
from winchkit.robot import robot_of
from winchkit.robot.calibration.calibrate import calibrate
from winchkit.robot.calibration.options import Options
from winchkit.robot.diagnosis.adjustment import equations_of, fitted_point, geometry_parameters
from winchkit.robot.diagnosis.dataset import RobotDataset, prepare_poses
from winchkit.robot.identification.bundle_adjustment import BundleState
from winchkit.robot.identification.variance_components import START
from winchkit.runs import read_run
from winchkit.schema.profiles.robot import PriorSpec

SIGMA = {**START, "closure": 8e-5, "position": 3e-5, "rotation": 1e-3, "swivel": 3e-3}


def text(count: int) -> str:
    return csv(rows(count, 3), angles=True, swivel=True)


@pytest.fixture
def dataset(tmp_path: Path) -> RobotDataset:
    path = tmp_path / "poses.csv"
    path.write_text(text(30))
    return prepare_poses([read_run(path)], robot().profile)


def test_derivatives_by_the_geometry_are_those_of_the_residuals(dataset: RobotDataset) -> None:
    """Of the robot of a profile with the numbers moved."""
    geometry = geometry_parameters(dataset)
    assert np.count_nonzero(geometry.lasting) == 65
    made, values = equations_of(dataset, geometry), geometry.nominal
    state = BundleState(values, made.start(values))
    by = {rows.kind: rows.by_values for rows in made.rows(state)}
    for index in np.flatnonzero(geometry.lasting):
        ends = []
        for sign in (1.0, -1.0):
            moved = values.copy()
            moved[index] += sign * 0.01 * geometry.std[index]
            there = robot_of(made.profile_at(moved))
            ends.append(
                made.residuals(BundleState(moved, state.pose), there, ["closure", "swivel"])
            )
        for kind, up in ends[0].items():
            slope = (up - ends[1][kind]) / (0.02 * geometry.std[index])
            known, own = np.isfinite(slope), by[kind]
            assert own is not None
            np.testing.assert_allclose(own[..., index][known], slope[known], 1e-5, 1e-6)


def test_a_calibration_estimates_the_same_geometry(dataset: RobotDataset) -> None:
    """Up to a hundredth of a standard deviation, the tolerance of the solver.

    A calibration keeps to the bounds of the profile's priors, a diagnosis has none.
    """
    profile = robot().profile
    profile = replace(profile, prior={n: PriorSpec(p.std) for n, p in profile.prior.items()})
    dataset = replace(dataset, robot=profile)
    geometry = geometry_parameters(dataset)
    point, _ = fitted_point(dataset, (), SIGMA, geometry)
    poses = measured(text(30))
    calibrated = calibrate(robot_of(profile), poses, held(), Options(sigma=SIGMA)).estimates
    differences = []
    for own, value in zip(geometry, point.state.values, strict=True):
        if own.std > 0 and not own.zero:
            estimate = calibrated[own.name]
            differences.append((value - estimate.value) / estimate.std)
    assert len(differences) == 65
    assert np.max(np.abs(differences)) < 0.01
