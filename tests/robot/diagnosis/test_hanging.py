"""Diagnosis of a four-cable hanging robot from logs without a tracker: its statics take part."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robot_poses.hanging import Hanging
from winchkit.arrays import Array
from winchkit.diagnosis.compare import compare
from winchkit.diagnosis.diagnose import diagnose
from winchkit.runs.read import read_run
from winchkit.runs.run import Run
from winchkit.schema.profiles.robot import RobotProfile
from winchkit.schema.read import read_robot

pytestmark = pytest.mark.slow
RIGHT = Hanging()


@pytest.fixture(scope="module")
def poses() -> Array:
    return RIGHT.poses(40, 21)


@pytest.fixture(scope="module")
def profile(tmp_path_factory: pytest.TempPathFactory) -> RobotProfile:
    path = tmp_path_factory.mktemp("profile") / "robot.toml"
    path.write_text(RIGHT.profile_text())
    return read_robot(path)


def run_of(robot: Hanging, poses: Array, folder: Path) -> Run:
    path = folder / "log.csv"
    path.write_text(robot.log(poses, 22))
    return read_run(path)


@pytest.mark.parametrize(
    ("robot", "named", "parameter", "value"),
    [
        (RIGHT, None, "", 0.0),
        (replace(RIGHT, ratio=(1.0, 1.0, 1.03, 1.0)), "gear-ratio/3", "ratio_error", 0.03),
        pytest.param(
            *(replace(RIGHT, gain=(1.0, 1.04, 1.0, 1.0)), "cell-gain/2", "gain_error", 0.04),
            marks=pytest.mark.campaign,
        ),
        (replace(RIGHT, mass=3.2), "payload-mass", "mass_error", 0.2),
    ],
)
def test_what_is_hidden_is_named(
    robot: Hanging,
    named: str | None,
    parameter: str,
    value: float,
    poses: Array,
    profile: RobotProfile,
    tmp_path: Path,
) -> None:
    found = diagnose([run_of(robot, poses, tmp_path)], profile).diagnosis
    if named is None:
        assert found.verdict == "adequate"
        assert found.steps == ()
        return
    assert found.verdict == "explained"
    (step,) = found.steps
    assert named in step.effects
    estimate = step.parameters[named][parameter]
    assert abs(estimate.value - value) < 4 * estimate.std
    fitted = found.outputs["cable_length"]
    assert fitted.heldout_rms_after < 1.5 * (fitted.noise_rms or np.inf)


def test_the_error_of_cable_lengths_is_that_of_the_drums(
    poses: Array, profile: RobotProfile, tmp_path: Path
) -> None:
    """Four cables alone determine no redundancy; swivels, statics and the IMU do."""
    wrong = replace(RIGHT, ratio=(1.0, 1.0, 1.03, 1.0))
    error = compare([run_of(wrong, poses, tmp_path)], profile).outputs["cable_length"]
    wound = np.array([RIGHT.motor_angles(pose) for pose in poses]) * RIGHT.truth.winding[2]
    expected = 0.03 * float(np.sqrt(np.mean(wound[:, 2] ** 2) / 4))
    assert error.rms == pytest.approx(expected, rel=0.35)
