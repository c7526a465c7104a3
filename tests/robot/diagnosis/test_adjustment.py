"""Joint estimate of poses and geometry: its derivatives, and that a calibration gives the same."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calibration_cases import measured, robot, rows
from robot_poses.truth import csv
from winchkit.effects import load_catalogue
from winchkit.robot import robot_of
from winchkit.robot.calibration.calibrate import calibrate
from winchkit.robot.calibration.options import Options
from winchkit.robot.diagnosis.adjustment import adjusted
from winchkit.robot.diagnosis.candidates import priors_of_geometry
from winchkit.robot.diagnosis.data.dataset import RobotDataset, prepare_poses
from winchkit.robot.diagnosis.equations import Equations, start_pose
from winchkit.robot.diagnosis.prior import GeometryPrior, profile_with_geometry
from winchkit.robot.diagnosis.variance_components import START
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


def name_of(item: GeometryPrior) -> str:
    """Name of the same number in a calibration."""
    if not item.line:
        return item.field
    axis = f".{item.parameter}" if item.parameter in ("x", "y", "z") else ""
    return f"{item.line}.{item.field}{axis}"


def test_derivatives_by_the_geometry_are_those_of_the_residuals(dataset: RobotDataset) -> None:
    geometry = priors_of_geometry(dataset, load_catalogue(), fitted=False)
    assert len(geometry) == 65
    equations = Equations(dataset, start_pose(dataset), robot())
    by = equations.by_geometry(robot(), geometry)
    for index, item in enumerate(geometry):
        up, down = (
            equations.residuals(robot_of(profile_with_geometry(robot().profile, [item.moved(s)])))
            for s in (0.01, -0.01)
        )
        for kind in ("closure", "swivel", "gauge"):
            slope = (up[kind] - down[kind]) / (0.02 * item.std)
            known = np.isfinite(slope)
            np.testing.assert_allclose(by[kind][..., index][known], slope[known], 1e-5, 1e-6)


def test_a_calibration_estimates_the_same_geometry(dataset: RobotDataset) -> None:
    """Up to a hundredth of a standard deviation, the tolerance of the solver.

    A calibration keeps to the bounds of the profile's priors, a diagnosis has none.
    """
    profile = robot().profile
    profile = replace(profile, prior={n: PriorSpec(p.std) for n, p in profile.prior.items()})
    dataset = replace(dataset, robot=profile)
    priors = priors_of_geometry(dataset, load_catalogue(), fitted=False)
    found = adjusted(dataset, (), SIGMA, priors)
    poses = measured(text(30))
    calibrated = calibrate(robot_of(profile), poses, options=Options(sigma=SIGMA)).estimates
    differences = []
    for item in found.geometry:
        own = calibrated[name_of(item)]
        differences.append((own.nominal + item.value - own.value) / own.std)
    assert len(differences) == 65
    assert np.max(np.abs(differences)) < 0.01
