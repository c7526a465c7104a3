"""Logs of a robot in motion, made by benchmarks/robot_poses/moving.py."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from robot_poses.hidden import profile_text
from robot_poses.moving import log
from winchkit.cli import main
from winchkit.model.robot import Pose, rotation_of
from winchkit.model.robot.identification.tracker import Tracker
from winchkit.model.robot.smoothed_motion import smoothed_motion
from winchkit.model.smoothing_spline import SmoothingSpline

DELAY = 0.02
Folder = Callable[[str], Path]


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("robot")
    (folder / "robot.toml").write_text(profile_text())
    log(folder / "late.csv", delay=DELAY)
    return folder


def call(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def test_uniform_motion_and_uniform_acceleration_have_their_derivatives() -> None:
    time = np.arange(100) * 0.02
    position = np.stack([0.1 * time, 0.05 * time**2, 0 * time], axis=1)
    pose = Pose(position, rotation_of(0.3 * time, 0 * time, 0 * time))
    motion, _, _ = smoothed_motion(SmoothingSpline.fit(time, position[:, 1]), pose)
    inner = slice(10, -10)
    np.testing.assert_allclose(motion.velocity[inner, 0], 0.1, atol=1e-6)
    np.testing.assert_allclose(motion.velocity[inner, 3], 0.3, atol=1e-6)
    np.testing.assert_allclose(motion.acceleration[inner, 1], 0.1, atol=1e-4)


def test_a_delay_alone_makes_a_tracker_differ_from_the_base_frame() -> None:
    assert Tracker.at(np.zeros(3)).is_trivial
    assert not Tracker(np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), delay=0.01).is_trivial


def test_the_delay_of_a_tracker_is_fitted_and_its_error_falls(robot: Path) -> None:
    run, profile, better = (robot / name for name in ("late.csv", "robot.toml", "better.toml"))
    result = call("add", "tracker-delay", "--fit", run, "-p", profile, "-o", better, "--json")
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    delay = found["parameters"]["tracker-delay"]["delay"]
    assert abs(delay["value"] - DELAY) < max(4 * delay["std"], 2e-4)
    assert delay["std"] < 1e-3
    before, after = (
        json.loads(call("compare", run, "-p", p, "--json").stdout)["outputs"]["platform_position"]
        for p in (profile, better)
    )
    # A tracker of 0.02 mm per axis.
    assert after["rms"] < 5e-5 < 10 * after["rms"] < before["rms"]


def test_a_log_in_motion_is_no_diagnosis_of_poses(robot: Path) -> None:
    result = call("diagnose", robot / "late.csv", "-p", robot / "robot.toml")
    assert result.exit_code == 3
    assert "needs poses at rest" in result.output


def test_a_declared_delay_is_corrected(robot: Path) -> None:
    profile = robot / "declared.toml"
    profile.write_text(profile_text() + '\n[instrument.tracker]\ndelay = "20 ms"\n')
    result = call("compare", robot / "late.csv", "-p", profile, "--json")
    assert json.loads(result.stdout)["outputs"]["platform_position"]["rms"] < 5e-5
