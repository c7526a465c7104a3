"""The tare in a log: gross beside net in every row, the tare in force, and every change of it."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from command_line import invoke
from fed import Fed, recording
from winchkit.bench.recording.recorder import Recorder
from winchkit.runs import read_run, write_run
from winchkit.runs.read import read_log
from winchkit.runs.recording.rotation import Rotation

mcap_reader = pytest.importorskip("mcap.reader")
OF_HOST = "12.5 N of the host, the device does not say whether it is tared"


def tare(fed: Fed, name: str, value: float, device: bool | None = None) -> None:
    cell = fed.sensors[name]["cell"]
    cell.host_tare, cell.tared = value, device


def test_rows_hold_gross_and_net_side_by_side(tmp_path: Path) -> None:
    """By Python's own reader; a reading of the test has a gross value of 1 N more than its net."""
    path = tmp_path / "lift.csv"
    with recording(path) as (fed, recorder):
        fed.run(recorder, 1.0)
    with path.open(newline="") as file:
        header, *rows = csv.reader(line for line in file if not line.startswith("#"))
    assert "A.tension [N]" in header
    assert "B.tension_gross [N]" in header
    assert not any(cell.startswith("A.temperature_gross") for cell in header)
    net, gross = header.index("B.tension [N]"), header.index("B.tension_gross [N]")
    assert [float(row[gross]) - float(row[net]) for row in rows] == pytest.approx([1.0] * len(rows))


def test_the_tare_in_force_is_metadata(tmp_path: Path) -> None:
    for suffix in ("csv", "mcap"):
        with recording(tmp_path / "a.mcap") as (fed, recorder):
            pass
        tare(fed, "A", 12.5)
        tare(fed, "B", 0.0, device=True)
        path = tmp_path / f"tared.{suffix}"
        with Recorder(path, fed.sensors, fed.clock, {}) as recorder:
            fed.run(recorder, 1.0)
        about = read_run(path).metadata
        assert about["tare.A.cell"] == OF_HOST
        assert about["tare.B.cell"] == "0 N of the host, the device shows net"
        assert "tare.A.temperature" not in about
        (tmp_path / "a.mcap").unlink()
    raw = (tmp_path / "tared.csv").read_bytes()
    assert f"# tare.A.cell: {OF_HOST}\n".encode() in raw


def test_a_change_of_the_tare_during_a_log_is_an_event(tmp_path: Path) -> None:
    """Read by the reader of the `mcap` package, which knows nothing of winchkit."""
    path = tmp_path / "lift.mcap"
    with recording(path) as (fed, recorder):
        begin = fed.clock.time
        fed.run_until_written(recorder, 1.0)
        tare(fed, "A", 12.5)
        fed.run_until_written(recorder, 1.0)
        tare(fed, "A", 12.5, device=True)
        fed.run(recorder, 1.0)
    with path.open("rb") as stream:
        reader = mcap_reader.make_reader(stream)
        events = [
            (message.log_time, json.loads(message.data)["tare"]["A.cell"])
            for _, _, message in reader.iter_messages(topics=["/events"])
        ]
    words = list(dict.fromkeys(text for _, text in events))
    assert [text.split(" N")[0] for text in words] == ["0", "12.5", "12.5"]
    assert words[2].endswith("the device shows net")
    log = read_log(path)
    changed = next(note.time for note in log.events if note.value["tare"]["A.cell"] == OF_HOST)
    assert changed - begin == pytest.approx(1.0, abs=0.1)
    told = invoke("log", "info", path).stdout
    assert "tare of A.cell: 0 N of the host" in told
    assert "tare of A.cell from 1.0" in told
    found = json.loads(invoke("log", "info", path, "--json").stdout)
    assert len([text for text in found["tares"] if text.startswith("A.cell")]) == 3


@pytest.mark.parametrize("suffix", ["csv", "mcap"])
def test_a_part_says_the_tare_with_which_it_begins(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"lift.{suffix}"
    with recording(path, "A", rotation=Rotation(duration=1.0)) as (fed, recorder):
        fed.run_until_written(recorder, 0.8)
        tare(fed, "A", 12.5)
        for _ in range(2):
            fed.run_until_written(recorder, 0.9)
    first, last = read_run(recorder.parts[0]), read_run(recorder.parts[-1])
    assert first.metadata["tare.A.cell"].startswith("0 N of the host")
    assert last.metadata["tare.A.cell"] == OF_HOST


def test_gross_is_kept_by_every_conversion(tmp_path: Path) -> None:
    with recording(tmp_path / "lift.mcap", "A") as (fed, recorder):
        tare(fed, "A", 1.0)
        fed.run(recorder, 1.0)
    run = read_run(tmp_path / "lift.mcap")
    write_run(run, tmp_path / "lift.csv")
    again = read_run(tmp_path / "lift.csv")
    assert np.array_equal(again["tension_gross"], run["tension_gross"])
    assert again["tension_gross"] - again["tension"] == pytest.approx(1.0)
    assert again.channels["tension_gross"].unit == "N"
