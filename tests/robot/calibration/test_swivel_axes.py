"""Swivel axes that are reversed in the profile, with poses whose cables are computed elsewhere."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from pathlib import Path

import pytest

from robot_poses.mistaken import Scene, profile_text, recorded
from winchkit.errors import UsageError
from winchkit.robot import calibrate, robot_of, write_calibrated
from winchkit.robot.calibration.calibrate import Calibrated
from winchkit.robot.calibration.prediction import rms
from winchkit.robot.calibration.profile import Provenance
from winchkit.robot.files.poses import read_poses
from winchkit.runs import read_run
from winchkit.schema.read import read_robot

SCENE = Scene("cabtive", True, True, 90, 2e-5, 2e-3, 1)
ALL, MOST = tuple("12345678"), tuple("13458")


def calibrated(folder: Path, scene: Scene, *reversed_lines: str) -> Calibrated:
    run, path = folder / "poses.csv", folder / "robot.toml"
    run.write_text(recorded(scene).csv())
    path.write_text(profile_text(scene.robot, known_frame=scene.known_frame))
    profile = read_robot(path)
    lines = [
        replace(line, swivel_axis=(0.0, 0.0, -line.swivel_axis[2]))
        if line.name in reversed_lines
        else line
        for line in profile.line
    ]
    assert all(line.swivel_axis[:2] == (0.0, 0.0) for line in profile.line)
    profile = replace(profile, line=tuple(lines))
    return calibrate(robot_of(profile), read_poses([read_run(run)], profile))


@pytest.mark.parametrize(
    ("lines", "known_frame"), [((), True), ((), False), (ALL, True), (ALL, False), (MOST, True)]
)
def test_reversed_axes_are_named_and_right_ones_are_not(
    tmp_path: Path, lines: tuple[str, ...], known_frame: bool
) -> None:
    found = calibrated(tmp_path, replace(SCENE, known_frame=known_frame, seed=len(lines)), *lines)
    assert found.reversed_axes == lines
    assert bool(found.refusal) == bool(lines)
    if lines:
        assert f"{', '.join(lines)}; nothing was written" in found.refusal


def test_nothing_is_written_with_them(tmp_path: Path) -> None:
    found, out = calibrated(tmp_path, SCENE, *ALL), tmp_path / "new.toml"
    with pytest.raises(UsageError, match="nothing was written"):
        write_calibrated(tmp_path / "robot.toml", found, out, Provenance([], date(2026, 11, 29)))
    assert not out.exists()


@pytest.mark.parametrize("line", ["2", "5"])
def test_a_single_reversed_axis_is_imitated_by_exit_points(tmp_path: Path, line: str) -> None:
    right, found = calibrated(tmp_path, SCENE), calibrated(tmp_path, SCENE, line)
    assert found.reversed_axes == ()
    assert found.refusal == ""
    error, least = found.validation_after.distance, right.validation_after.distance
    assert rms(error) < 1.2 * rms(least)
