"""A tracker that was set up anew is named as such, alone and beside an effect of one line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from model_files import answer
from robot_poses.cases import CASES
from robot_poses.hidden import profile_text
from robot_poses.station import Station, about, observed
from robot_poses.truth import HOME
from winchkit.schema.read import read_robot

BY_NAME = {case.name: case for case in CASES}
SMALL = replace(about(0.02), shift=(3e-4, -3e-4, 2e-4))


def named(found: dict[str, Any]) -> list[set[str]]:
    return [
        {
            effect + (f"/{line}" if line else "")
            for effect, lines in step["lines"].items()
            for line in lines
        }
        for step in found["steps"]
    ]


def files(folder: Path, case: str, station: Station, **how: Any) -> tuple[Path, Path]:
    profile, run = folder / "robot.toml", folder / "poses.csv"
    profile.write_text(profile_text())
    run.write_text(observed(BY_NAME[case], station, **how))
    return profile, run


@pytest.mark.parametrize(
    ("case", "station", "expected"),
    [
        ("none", SMALL, [{"tracker-frame"}]),
        ("none", Station(37.0, shift=(0.1, 0.2, -0.3)), [{"tracker-frame"}]),
        ("none", Station(reflector=(0.01, 0.005, 0.025)), [{"reflector-offset"}]),
        ("none", Station(ppm=500.0), [{"tracker-scale"}]),
        ("home length", SMALL, [{"tracker-frame"}, {"home-length/4"}]),
        pytest.param(
            *("exit point", Station(37.0), [{"tracker-frame"}, {"exit-point/3"}]),
            marks=pytest.mark.campaign,
        ),
        pytest.param(
            *("drum radius", about(0.2), [{"tracker-frame"}, {"drum-radius/2", "gear-ratio/2"}]),
            marks=pytest.mark.campaign,
        ),
    ],
    ids=["small", "37 deg", "reflector", "scale", "home length", "exit point", "drum radius"],
)
def test_the_tracker_is_named_and_no_wrong_line(
    case: str, station: Station, expected: list[set[str]], tmp_path: Path
) -> None:
    profile, run = files(tmp_path, case, station, angles=False, tension=False)
    found = answer("diagnose", run, "--profile", profile)
    assert found["verdict"] == "explained"
    assert sorted(map(sorted, named(found))) == sorted(map(sorted, expected))
    output = found["outputs"]["platform_position"]
    assert output["heldout_rms_after"] < 4e-5


def test_the_frame_has_its_values_and_angles_of_an_imu_are_recognised(tmp_path: Path) -> None:
    station = Station(30.0, (0.0, 0.0, 1.0), shift=(0.05, -0.1, 0.2), turns_rotation=False)
    profile, run = files(tmp_path, "none", station, tension=False)
    found = answer("diagnose", run, "--profile", profile)
    assert named(found) == [{"tracker-frame"}]
    values = found["steps"][0]["parameters"]["tracker-frame"]
    shift = [values[axis]["value"] for axis in "xyz"]
    np.testing.assert_allclose(shift, station.shift, atol=5e-5)
    assert values["rz"]["value"] == pytest.approx(np.radians(30.0), abs=1e-4)
    assert any("IMU" in note for note in found["notes"])


def test_a_frame_and_a_reflector_explain_the_error_in_turn(tmp_path: Path) -> None:
    station = Station(37.0, (0.0, 0.0, 1.0), (0.1, 0.2, -0.3), reflector=(0.03, 0.02, 0.08))
    profile, run = files(tmp_path, "none", station, tension=False)
    found = answer("diagnose", run, "--profile", profile)
    assert named(found) == [{"tracker-frame"}, {"reflector-offset"}]
    first, second = (step["explains"] for step in found["steps"])
    assert first > 0.5
    assert first + second == pytest.approx(1.0, abs=0.01)


def test_numbers_that_the_file_has_or_declares_unknown_are_not_missing(tmp_path: Path) -> None:
    station = Station(37.0, (0.0, 0.0, 1.0), (0.1, 0.2, -0.3), reflector=(0.03, 0.02, 0.08))
    profile, run = files(tmp_path, "none", station, tension=False)
    unknown = '\n[instrument.tracker]\nframe = "unknown"\nreflector = ["30 mm", "20 mm", "80 mm"]\n'
    profile.write_text(profile_text() + unknown)
    found = answer("diagnose", run, "--profile", profile)
    assert (found["verdict"], found["steps"]) == ("adequate", [])
    home = np.array(HOME)
    x, y, z = (home + np.array(station.shift) - station.rotation @ home).tolist()
    place = f'["{x!r} m", "{y!r} m", "{z!r} m"]'
    frame = f'{{ position = {place}, rotation = ["0 deg", "0 deg", "37 deg"] }}'
    profile.write_text(profile_text() + unknown.replace('"unknown"', frame))
    assert read_robot(profile).instrument.tracker.frame != "unknown"
    compared = answer("compare", run, "--profile", profile)
    assert compared["outputs"]["platform_position"]["rms"] < 1e-4
    found = answer("diagnose", run, "--profile", profile)
    assert (found["verdict"], found["steps"]) == ("adequate", [])


def test_the_frame_is_added_to_the_profile(tmp_path: Path) -> None:
    profile, run = files(tmp_path, "none", about(0.2), angles=False, tension=False)
    better = tmp_path / "better.toml"
    answer("add", "tracker-frame", "--fit", run, "-p", profile, "-o", better)
    (table,) = read_robot(better).effect
    assert table.id == "tracker-frame"
    after = answer("compare", run, "--profile", better)
    assert after["outputs"]["platform_position"]["rms"] < 4e-5
