"""Recordings that others made: EMPS by the variables of its authors, and three joints.

The data carry no licence of ours and are no part of the project; the tests are skipped without
them. WINCHKIT_EMPS and WINCHKIT_REAL name the folders, else ``shared/data`` beside the checkout.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from recordings_of_others import emps_variables, folder
from winchkit.runs import read_run
from winchkit.runs.importing.answers import Answers, read_column
from winchkit.runs.importing.clocks.joint import joined
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.mapping import mapping_of, write_mapping
from winchkit.runs.importing.runs import run_of
from winchkit.runs.importing.streams import streams_of
from winchkit.runs.run import Run

EMPS, REAL = folder("WINCHKIT_EMPS", "emps"), folder("WINCHKIT_REAL", "real")


@pytest.mark.skipif(EMPS is None, reason="the EMPS data are not here; WINCHKIT_EMPS names them")
@pytest.mark.parametrize("name", ["train", "test"])
def test_emps_by_the_variables_of_its_authors(name: str, tmp_path: Path) -> None:
    assert EMPS is not None
    known = read_run(EMPS / f"{name}.csv")
    force = known["motor_torque"]
    path = tmp_path / "DATA_EMPS.mat"
    savemat(path, emps_variables(EMPS / f"{name}.csv"))
    plain = guess_columns(read_table(path))
    assert {item.channel for item in plain.used} == {"time", "motor_angle"}
    answers = Answers(columns=(read_column("motor_torque=vir*gtau"),))
    guess = guess_columns(read_table(path), answers)
    assert not guess.questions
    mapping = tmp_path / "emps.toml"
    write_mapping(mapping_of("emps", [("emps", guess)]), mapping)
    run = read_run(path, mapping=mapping)
    # Times start at the first sample.
    assert run.time == pytest.approx(known.time - known.time[0], abs=1e-12)
    assert np.array_equal(run["motor_angle"], known["motor_angle"])
    assert run["motor_torque"] == pytest.approx(force, rel=1e-12)


def _paths() -> list[Path]:
    return sorted(REAL.glob("*/*.csv")) if REAL is not None else []


@pytest.mark.slow
@pytest.mark.skipif(REAL is None, reason="the recordings are not here; WINCHKIT_REAL names them")
@pytest.mark.parametrize("form", ["semicolons", "degrees"])
@pytest.mark.parametrize("path", _paths(), ids=lambda path: path.stem)
def test_recordings_in_another_layout_are_the_same_run(
    path: Path, form: str, tmp_path: Path
) -> None:
    """Real stamps (jitter, gaps) and quantised signals, written as two other programs do."""
    known = _beginning(read_run(path))
    units = {
        "motor_angle": "°",
        "motor_velocity": "1/min",
        "motor_torque": "Nm",
        "temperature": "°C",
    }
    scale = {"motor_angle": 180 / np.pi, "motor_velocity": 30 / np.pi}
    names = {"motor_angle": "Winkel", "motor_velocity": "Drehzahl", "motor_torque": "Drehmoment",
             "temperature": "Temperatur"}  # fmt: skip
    columns = [known.time * 1e3, *(known[name] * scale.get(name, 1.0) for name in known)]
    head = ["Zeit [ms]", *(f"{names[name]} [{units[name]}]" for name in known)]
    mark, comma = (";", ",") if form == "semicolons" else ("\t", ".")
    rows = zip(*columns, strict=True)
    lines = [mark.join(f"{v:.15g}".replace(".", comma) for v in row) for row in rows]
    other = tmp_path / "log.txt"
    other.write_text(
        "\r\n".join(["Messung", "", mark.join(head), *lines]) + "\r\n", encoding="cp1252"
    )
    guess = guess_columns(read_table(other))
    assert not guess.questions
    assert all(item.confidence == "named" for item in guess.used)
    run = run_of(streams_of(guess), {})
    _equal(run, known)


def _beginning(run: Run, rows: int = 4000) -> Run:
    channels = {
        name: replace(channel, values=channel.values[:rows])
        for name, channel in run.channels.items()
    }
    return replace(run, time=run.time[:rows], channels=channels)


def _equal(run: Run, known: Run) -> None:
    assert len(run) == len(known)
    assert run.time == pytest.approx(known.time - known.time[0], abs=1e-9)
    assert set(run) == set(known)
    for name in known:
        assert run[name] == pytest.approx(known[name], rel=1e-9, abs=1e-12, nan_ok=True)


PLANAR = None if REAL is None else REAL / "robots" / "planar"
TAKE = "13_concentric_diamonds_1mps_cal"


@pytest.mark.skipif(PLANAR is None or not PLANAR.is_dir(), reason="the recording is not here")
def test_the_clock_of_a_tracker_beside_a_robot_of_four_cables() -> None:
    """A controller's log without times beside an OptiTrack export.

    Of the repository ``gchenfc/cable-robot`` (``analysis/gerry00_estimation``). The expected lag
    is that of the authors: the controller's own estimate of the position against the tracker.
    """
    assert PLANAR is not None
    lines = [read_column(f"{n + 1}.motor_angle={10 + 5 * n}*-100 [rad]") for n in range(4)]
    log = guess_columns(
        read_table(PLANAR / f"{TAKE}.txt"), Answers(columns=tuple(lines), sample_rate=100.0)
    )
    metres = read_column("platform_x=Rigid Body Rigid Body 2 Position X [m]")
    tracker = guess_columns(read_table(PLANAR / f"{TAKE}.csv"), Answers(columns=(metres,)))
    _, (joint,) = joined([streams_of(log), streams_of(tracker)])
    table = np.array([row.split()[1:3] for row in rows_of(PLANAR / f"{TAKE}.txt")], dtype=float)
    time = np.arange(len(table)) / 100.0
    streams = {name: s for s in streams_of(tracker).streams for name in s.channels}
    seen = streams["platform_z"]

    def misfit(lag: float) -> float:
        own = np.interp(time + lag, seen.time, seen.channels["platform_z"])
        columns = np.column_stack([np.ones_like(own), own])
        return float(np.linalg.lstsq(columns, table[:, 0], rcond=None)[1][0])

    lags = np.arange(0.0, 3.0, 0.002)
    expected = lags[np.argmin([misfit(lag) for lag in lags])]
    assert -joint.lag == pytest.approx(expected, abs=0.005)
    assert joint.agreement is not None
    assert joint.agreement.correlation > 0.999


def rows_of(path: Path) -> list[str]:
    return [line for line in path.read_text().splitlines() if line[:1].isdigit()]
