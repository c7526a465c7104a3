"""A log in which a drive or an instrument falls silent: its rows, its gaps, and the reports."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from fed import CYCLE, EVERY, angle, recording
from sim_process import first_line, start
from waiting import until
from winchkit.runs import read_run
from winchkit.runs.info import info_of, summary_of
from winchkit.runs.read import read_log
from winchkit.runs.sanity.inspection import inspect_run

_PERIOD = EVERY["cell"] * CYCLE


@pytest.mark.parametrize("suffix", ["csv", "mcap"])
@pytest.mark.parametrize("silent", ["A.cell", "B.cell", "A.drive", "B.drive"])
def test_rows_of_the_others_go_on_with_nan(tmp_path: Path, suffix: str, silent: str) -> None:
    path = tmp_path / f"lift.{suffix}"
    winch, _, role = silent.partition(".")
    channel = "tension" if role == "cell" else "motor_angle"
    with recording(path) as (fed, recorder):
        fed.run(recorder, 2.0)
        fed.silent.add(silent)
        fed.run(recorder, 3.0)
    run = read_run(path)
    assert recorder.rows == pytest.approx(len(run), abs=1)
    assert run.time[-1] > 4.8, "rows go on to the end of the log"
    assert np.diff(run.time).max() < 0.06, "and without a gap"
    assert np.diff(run.time[run.time > 2.5]).max() < 1.3 * _PERIOD, "as densely as before"
    quiet = run.time > 2.1
    assert np.isnan(run[f"{winch}.{channel}"][quiet]).all(), "no value is invented"
    other = "B" if winch == "A" else "A"
    start = run[f"{other}.motor_angle"][0] / 3
    known = run[f"{other}.motor_angle"][:-5]
    assert known == pytest.approx(angle(start + run.time[:-5]), abs=1e-6)
    found = summary_of(run)
    assert found.gaps == 1
    assert found.ended[f"{winch}.{channel}"] == pytest.approx(3.0, abs=0.1)


@pytest.mark.parametrize(("silent", "period"), [("A.cell", _PERIOD), ("A.drive", CYCLE)])
def test_a_silence_is_counted_while_it_lasts_and_afterwards(
    tmp_path: Path, silent: str, period: float
) -> None:
    with recording(tmp_path / "lift.mcap") as (fed, recorder):
        fed.run(recorder, 2.0)
        time.sleep(0.2)
        assert recorder.counters()["log"]["silent"] == {}
        fed.silent.add(silent)
        for _ in range(5):
            fed.run(recorder, 0.4)
            time.sleep(0.1)
        (found,) = recorder.counters()["log"]["silent"].items()
        assert found[0] == silent
        assert found[1]["now"] == pytest.approx(2.0, abs=0.05)
        fed.silent.clear()
        fed.run(recorder, 2.0)
        time.sleep(0.3)
        found = recorder.counters()["log"]["silent"][silent]
        assert (found["times"], found["now"]) == (1, 0.0)
        assert found["longest"] == pytest.approx(2.0 + period, abs=0.05)


@pytest.mark.parametrize(("before", "after"), [(2.0, 3.0), (0.0, 3.0), (3.0, 0.0)])
def test_gaps_count_up_to_both_ends_of_the_log(tmp_path: Path, before: float, after: float) -> None:
    path = tmp_path / "lift.mcap"
    with recording(path) as (fed, recorder):
        fed.silent.add("B.temperature")
        if after:
            fed.run(recorder, before)
            fed.silent.add("A.cell")
            fed.run(recorder, after)
        else:
            fed.silent.add("A.cell")
            fed.run(recorder, before)
            fed.silent.remove("A.cell")
            fed.run(recorder, 2.0)
    sources = {item.topic: item for item in info_of(read_log(path)).sources}
    cell = sources["/A/cell"]
    assert cell.gaps == 1
    assert cell.longest_gap == pytest.approx(max(before if not after else 0.0, after), abs=0.1)
    assert sources["/B/cell"].gaps == 0
    assert (sources["/B/temperature"].samples, sources["/B/temperature"].gaps) == (0, 1)


def test_a_file_has_one_number_of_gaps_whoever_counts(tmp_path: Path) -> None:
    """Lost rows (one and many, in a row and a long interval), and a channel without values."""
    time = np.delete(np.arange(1000) / 100, [50, *range(120, 125), *range(400, 620)])
    tension = 100 + np.sin(time)
    tension[(time > 7) & (time < 8)] = np.nan
    angle = 5 * np.sin(time)
    path = tmp_path / "a.csv"
    rows = zip(time.tolist(), angle.tolist(), tension.tolist(), strict=True)
    lines = [f"{t:.4f},{a:.6f},{'' if n != n else f'{n:.3f}'}" for t, a, n in rows]
    path.write_text("\n".join(["time [s],motor_angle [rad],tension [N]", *lines]) + "\n")
    run = read_run(path)
    (source,) = info_of(read_log(path)).sources
    (found,) = (item for item in inspect_run(run).findings if item.code == "gap")
    assert (run.gaps, summary_of(run).gaps, source.gaps) == (4, 4, 4)
    assert found.text.startswith("4 gaps")
    assert source.longest_gap == pytest.approx(2.21)
    assert source.rate == pytest.approx(100), "the gaps do not make it slower"


@pytest.fixture
def served(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """A simulated bench that takes lines."""
    words = ("sim", "serve", "spiral-bench", "--bench-file", "bench.toml")
    with start(*words, stdin=subprocess.PIPE, folder=tmp_path) as process:
        assert process.stdin is not None
        first_line(process)
        yield process
        process.stdin.write("quit\n")
        process.stdin.flush()
        process.communicate(timeout=20)


@pytest.mark.realtime
@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize(("strict", "code"), [((), 0), (("--strict",), 1)])
def test_the_command_reports_it_at_once_and_at_the_end(
    served: subprocess.Popen[str], tmp_path: Path, strict: tuple[str, ...], code: int
) -> None:
    path = tmp_path / "lift.csv"
    words = ("log", "-b", "bench.toml", "-o", path, "--for", "4s", *strict)
    with start(*words, folder=tmp_path) as log:
        until(lambda: path.is_file() and len(path.read_text().split("\n")) >= 60, 30.0)
        served.stdin.write("fault A.cell silence\n")
        served.stdin.flush()
        first = log.stderr.readline()
        assert log.poll() is None, "it is reported while the log goes on"
        assert "A.cell: no sample for" in first
        _, told = log.communicate(timeout=30)
    assert log.returncode == code
    assert "A.cell was silent 1 time" in told
    assert "at the end of the log" in told
    run = read_run(path)
    assert run.time[-1] > 3.5
    assert np.isnan(run["tension"][-50:]).all()
    assert np.isfinite(run["motor_angle"][-50:-5]).all()
