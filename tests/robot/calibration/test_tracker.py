"""A tracker that was set up anew, a reflector off the origin: fitted as such, never as cables."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calibration_cases import EXACT, measured, robot, rows
from command_line import invoke
from model_files import answer
from robot_poses.mistaken import Scene, profile_text, recorded
from robot_poses.station import Station, about
from robot_poses.truth import csv
from winchkit.catalog import find
from winchkit.model.rotation import angles_of, rotation_of
from winchkit.robot import robot_of
from winchkit.robot.calibration.calibrate import calibrate, split
from winchkit.robot.calibration.prediction import rms
from winchkit.robot.files.poses import joined, read_poses
from winchkit.runs import read_run
from winchkit.schema.profiles.instruments import FrameSpec, InstrumentSpec, TrackerSpec
from winchkit.schema.read import read_robot

MOVED = {
    "0.02 deg, 0.5 mm": (replace(about(0.02), shift=(3e-4, -3e-4, 2e-4)), {"frame"}),
    "0.2 deg": (about(0.2), {"frame"}),
    "1 deg": (replace(about(1.0), shift=(5e-3, 2e-3, -1e-3)), {"frame"}),
    "37 deg": (Station(37.0, shift=(0.1, 0.2, -0.3)), {"frame"}),
    "37 deg, angles of an IMU": (
        Station(37.0, shift=(0.1, 0.2, -0.3), turns_rotation=False),
        {"frame"},
    ),
    "reflector 10/5/25 mm": (Station(reflector=(0.01, 0.005, 0.025)), {"reflector"}),
    "reflector 30/20/80 mm": (Station(reflector=(0.03, 0.02, 0.08)), {"reflector"}),
    "37 deg and 30/20/80 mm": (
        Station(37.0, shift=(0.1, 0.2, -0.3), reflector=(0.03, 0.02, 0.08)),
        {"frame", "reflector"},
    ),
    "0.24 deg, 0.5 m and 10/26/130 mm, angles of an IMU": (
        Station(
            0.24, shift=(0.08, 0.28, 0.41), reflector=(-0.01, -0.026, -0.13), turns_rotation=False
        ),
        {"frame", "reflector"},
    ),
}


def seen(station: Station, *, angles: bool = True, seed: int = 1, count: int = 90) -> str:
    return csv(station.show(rows(count, seed, noise=EXACT), seed), angles=angles)


ALONE = ("0.02 deg, 0.5 mm", "reflector 10/5/25 mm", "37 deg and 30/20/80 mm")
"""Cases that ``.ci/run`` has of positions without angles; the others belong to the campaign."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "angles"),
    [
        pytest.param(
            case,
            angles,
            id=f"{case}-{'angles' if angles else 'positions alone'}",
            marks=() if angles or case in ALONE else pytest.mark.campaign,
        )
        for case in MOVED
        for angles in (True, False)
    ],
)
def test_a_tracker_set_up_anew_is_fitted_as_such(case: str, angles: bool) -> None:
    station, expected = MOVED[case]
    found = calibrate(robot(), *split(measured(seen(station, angles=angles))))
    assert found.refusal == ""
    assert found.found_instruments == expected
    # Noise of three coordinates of 0.02 mm.
    assert rms(found.validation_after.distance) < 4e-5
    if angles:
        assert rms(found.validation_after.angle) < 1.3 * 1e-3 * 3**0.5
    assert any("the poses require" in text for text in found.warnings)
    assert any("check [home] first" in text for text in found.warnings)
    own = found.equations.instruments_at(found.values)
    assert own is not None
    if expected == {"reflector"}:
        np.testing.assert_allclose(own.trackers[0].offset, station.reflector, atol=5e-5)


def test_a_target_that_is_turned_on_the_platform_is_fitted_as_such() -> None:
    """In a known frame; a home that is turned by 3 degrees gives the same data."""
    fit = measured(seen(Station()))
    c, s = np.cos(np.radians(3.0)), np.sin(np.radians(3.0))
    shown = rotation_of(*fit.angles.T) @ np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))
    found = calibrate(robot(), *split(replace(fit, angles=angles_of(shown))))
    assert found.found_instruments == {"mounting"}
    assert rms(found.validation_after.angle) < 1.3 * 1e-3 * 3**0.5
    assert any("a home pose that is turned" in text for text in found.warnings)


def test_drums_of_another_size_are_not_a_trackers_scale(tmp_path: Path) -> None:
    scene = Scene("ipanema3", True, True, 50, 2e-5, 2e-3, 6)
    table, path, run = recorded(scene), tmp_path / "robot.toml", tmp_path / "poses.csv"
    path.write_text(profile_text(scene.robot, known_frame=True))
    run.write_text(replace(table, motor=1.05 * table.motor).csv())
    profile = read_robot(path)
    found = calibrate(robot_of(profile), *split(read_poses([read_run(run)], profile)))
    assert found.found_instruments == frozenset()
    assert rms(found.validation_after.distance) < 2e-4
    assert [ratio.change for ratio in found.ratios.lines] == pytest.approx([-1 / 21] * 8, abs=0.015)


def test_orientations_of_true_poses_are_predicted_to_a_thirtieth_of_a_degree() -> None:
    station = Station(37.0, shift=(0.1, 0.2, -0.3))
    exact = replace(station, tracker=0.0, imu=0.0)
    fit = measured(seen(station))
    held = measured(csv(exact.show(rows(40, 99, noise=EXACT), 1), angles=True))
    held = replace(held, session_of_run=fit.session_of_run)
    found = calibrate(robot(), fit, held)
    assert rms(found.validation_after.distance) < 4e-5
    assert rms(found.validation_after.angle) < np.radians(0.03)


def test_a_robot_in_its_own_frame_gets_no_numbers_of_a_tracker() -> None:
    found = calibrate(robot(), *split(measured(seen(Station()))))
    assert found.equations.instruments is None
    assert found.found_instruments == frozenset()


def declared(**numbers: Any) -> Any:
    spec = InstrumentSpec(tracker=TrackerSpec(**numbers))
    return robot_of(replace(robot().profile, instrument=spec))


def test_a_session_has_its_own_frame_and_another_one_is_registered() -> None:
    stations = [Station(12.0, shift=(0.1, 0.0, 0.2)), Station(-5.0, shift=(-0.2, 0.1, 0.0))]
    parts = [measured(seen(s, seed=n + 1, count=45)) for n, s in enumerate(stations)]
    second = replace(parts[1], run=parts[1].run + 1, session_of_run=("second",))
    both = joined([replace(parts[0], session_of_run=("first",)), second])
    held = measured(seen(Station(80.0, shift=(1.0, 0.0, 0.0)), seed=7, count=20))
    found = calibrate(declared(frame="unknown"), both, held)
    own = found.equations.instruments_at(found.values)
    assert own is not None
    assert own.sessions == ("first", "second")
    for station, tracker in zip(stations, own.trackers, strict=True):
        # Home is exact in both, and the readings are turned about it.
        np.testing.assert_allclose(tracker.shift, station.shift, atol=5e-4)
    assert rms(found.validation_after.distance) < 4e-5


def test_a_known_frame_and_reflector_are_used_as_declared() -> None:
    station = Station(37.0, (0.0, 0.0, 1.0), (0.1, 0.2, -0.3), reflector=(0.03, 0.02, 0.08))
    home = np.array(robot().home.position[0])
    origin = home + np.array(station.shift) - station.rotation @ home
    place: tuple[float, float, float] = (float(origin[0]), float(origin[1]), float(origin[2]))
    frame = FrameSpec(place, (0.0, 0.0, np.radians(37.0)))
    known = declared(frame=frame, reflector=station.reflector)
    found = calibrate(known, *split(measured(seen(station))))
    assert found.found_instruments == frozenset()
    # The nominal robot's 1.8 mm, and 0.8 degrees at 88 mm.
    assert rms(found.validation_before.distance) < 4e-3
    assert rms(found.validation_after.distance) < 4e-5


@pytest.mark.parametrize("datum", ["robot", "tracker"])
def test_the_written_profile_predicts_in_the_datum(datum: str, tmp_path: Path) -> None:
    station = Station(37.0, shift=(0.1, 0.2, -0.3))
    run, profile, new = (tmp_path / name for name in ("poses.csv", "robot.toml", "new.toml"))
    run.write_text(seen(station))
    (tmp_path / "cabtive-winch.toml").write_text(find("profiles", "cabtive-winch").read_text())
    table = f'\n[instrument.tracker]\nframe = "unknown"\ndatum = "{datum}"\n'
    profile.write_text(find("profiles", "cabtive").read_text() + table)
    told = answer("calibrate", profile, run, "-o", new)
    assert told["instruments"]["datum"] == datum
    assert told["refused"] is None
    (frame,) = told["instruments"]["frames"].values()
    home = np.array(robot().home.position[0])
    expected = home + np.array(station.shift) - station.rotation @ home
    np.testing.assert_allclose(frame["position"], expected, atol=1e-3)
    # Other poses of the same set-up, with the written numbers alone.
    written = robot_of(read_robot(new))
    exact = replace(station, tracker=0.0, imu=0.0)
    other, held = (
        measured(csv(exact.show(rows(30, seed, noise=EXACT), 1), angles=True)) for seed in (6, 5)
    )
    again = calibrate(written, other, held)
    assert rms(again.validation_before.distance) < 4e-5
    assert rms(again.validation_before.angle) < np.radians(0.03)


def test_nothing_is_written_where_the_starting_profile_predicts_better(tmp_path: Path) -> None:
    """Poses of a calibrated robot, fitted to a few poses with a coarse tracker."""
    good, run, held = (tmp_path / name for name in ("good.toml", "few.csv", "held.csv"))
    first = tmp_path / "first.csv"
    first.write_text(seen(Station()))
    held.write_text(seen(Station(), seed=5))
    assert invoke("calibrate", "cabtive", first, "-o", good).exit_code == 0
    run.write_text(seen(Station(tracker=5e-4), seed=3, count=12))
    result = invoke("calibrate", good, run, "--validate", held, "-o", tmp_path / "worse.toml")
    assert result.exit_code == 1
    assert "not calibrated: the held-out position error" in result.stderr
    assert not (tmp_path / "worse.toml").exists()
