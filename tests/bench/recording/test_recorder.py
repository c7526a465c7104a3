"""The recorder: every channel and its own time, rows of it, and a disk that is full."""

from __future__ import annotations

import csv
import logging
import os
import random
import re
import resource
import sys
from pathlib import Path

import numpy as np
import pytest

from command_line import own_process
from fed import BENCHMARKS, CYCLE, DELAY, SUPPORT, Fed, SetClock, angle, give, recording, tension
from recorder_kill import kill_once
from small_disk import run_on_small_disk
from winchkit.bench.control.snapshot import Phase
from winchkit.bench.recording.recorder import Recorder
from winchkit.drivers.reading import Quality
from winchkit.errors import FileError, UsageError
from winchkit.runs import read_run
from winchkit.runs.info import info_of
from winchkit.runs.read import read_log
from winchkit.runs.recording.rotation import Rotation


@pytest.mark.parametrize("suffix", ["csv", "mcap"])
def test_rows_stand_at_readings_and_have_every_channel_at_that_moment(
    tmp_path: Path, suffix: str
) -> None:
    path = tmp_path / f"lift.{suffix}"
    with recording(path, metadata={"programme": "up"}) as (fed, recorder):
        begin = fed.clock.time
        fed.run(recorder, 3.0)
    run = read_run(path)
    assert run.winches() == ["A", "B"]
    assert list(run.of_winch("B")) == [
        "motor_angle",
        "motor_velocity",
        "motor_torque",
        "tension",
        "tension_gross",
        "temperature",
    ]
    assert run.metadata["programme"] == "up"
    assert run.metadata["clock_offset"].endswith(" s")
    assert recorder.rows == pytest.approx(len(run), abs=1)
    assert run.interval == pytest.approx(5 * CYCLE)
    start = run["A.motor_angle"][0] / 3
    assert begin <= start <= begin + 0.2
    assert run["A.motor_angle"] == pytest.approx(angle(start + run.time), abs=1e-6)
    assert run["B.tension"] == pytest.approx([tension(start + t) for t in run.time], abs=1e-6)
    assert len(run) >= 140


def test_both_formats_hold_the_same_run(tmp_path: Path) -> None:
    runs = []
    for suffix in ("csv", "mcap"):
        with recording(tmp_path / f"a.{suffix}") as (fed, recorder):
            fed.run(recorder, 2.0)
        runs.append(read_run(tmp_path / f"a.{suffix}"))
    shared = min(map(len, runs))
    assert shared >= 90
    assert list(runs[0]) == list(runs[1])
    assert runs[0].time[:shared] == pytest.approx(runs[1].time[:shared], abs=1e-8)
    for name in runs[0]:
        assert runs[0][name][:shared] == pytest.approx(runs[1][name][:shared], abs=1e-6)


@pytest.mark.parametrize("suffix", ["csv", "mcap"])
def test_a_closed_log_goes_on_to_the_last_reading_of_its_load_cell(
    tmp_path: Path, suffix: str
) -> None:
    """Whatever slower instruments had yet to say: the thermometer's next reading never comes."""
    path = tmp_path / f"a.{suffix}"
    with recording(path, "A") as (fed, recorder):
        begin = fed.clock.time
        fed.run(recorder, 2.09)
    run = read_run(path)
    last = run["motor_angle"][-1] / 3
    assert last == pytest.approx(begin + 2.08 - DELAY, abs=1e-6)
    assert np.isnan(run["temperature"][-1])
    assert run.interval == pytest.approx(5 * CYCLE)


def test_a_log_by_channels_loses_nothing(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with recording(path) as (fed, recorder):
        begin = fed.clock.time
        fed.run(recorder, 1.0)
        give(fed.sensors["A"]["cell"], float("nan"), fed.clock.time + 0.01, Quality.OVERLOAD)
        fed.trip("tension 900 N above 800 N")
        fed.run(recorder, 1.0)
    log = read_log(path)
    drive = log.samples["/A/drive"]
    assert drive.times == pytest.approx(begin + CYCLE * np.arange(500), abs=1e-6)
    assert drive.values[:, 0] == pytest.approx(angle(drive.times), abs=1e-5)
    cell, names = log.samples["/A/cell"], [item.name for item in log.layout.sources[2].signals]
    assert len(cell) == 101
    flagged = cell.values[:, names.index("quality")] != 0
    assert flagged.sum() == 1
    assert cell.values[flagged, names.index("quality")] == Quality.OVERLOAD.value
    assert np.isnan(cell.values[flagged, names.index("tension")]).all()
    assert cell.received - cell.times == pytest.approx(DELAY, abs=1e-6)
    assert cell.times - cell.values[:, names.index("t_request")] == pytest.approx(
        2e-3 - DELAY, abs=1e-6
    )
    assert [note.value["tripped"] for note in log.events] == [
        [],
        ["winch A: tension 900 N above 800 N"],
    ]
    assert log.counters[-1].value["log"]["drops"] == 0
    assert set(log.counters[-1].value) >= {"A.cell", "B.temperature"}


@pytest.mark.parametrize("suffix", ["csv", "mcap"])
@pytest.mark.parametrize("rotation", [None, Rotation(size=8_000)])
def test_every_log_has_its_trips_and_who_commanded_each_winch_when(
    tmp_path: Path, suffix: str, rotation: Rotation | None
) -> None:
    path = tmp_path / f"a.{suffix}"
    with recording(path, "A", rotation=rotation) as (fed, recorder):
        for name in ("jog of anna", "move of ben", ""):
            fed.commander = name
            fed.run_until_written(recorder, 1.0)
        fed.trip("tension 900 N above 800 N")
        fed.run(recorder, 0.5)
    assert len(recorder.parts) > 1 or rotation is None
    info = info_of(read_log(path if rotation is None else recorder.parts))
    texts = [re.sub(r"\d\.\d+ s", "T", text) for text in info.commanders]
    assert texts == ["A: jog of anna", "A from T on: move of ben", "A from T on: none"]
    times = [float(text.split()[2]) for text in info.commanders[1:]]
    assert times == pytest.approx([1.0, 2.0], abs=0.1)
    assert info.events == ("winch A: tension 900 N above 800 N",)


def test_torque_is_unknown_while_the_drive_is_unpowered(tmp_path: Path) -> None:
    with recording(tmp_path / "a.mcap", "A") as (fed, recorder):
        fed.phase = Phase.DISABLED
        fed.run(recorder, 1.0)
        fed.phase = Phase.MOVING
        fed.run(recorder, 1.0)
    run = read_run(tmp_path / "a.mcap")
    early = run.time < 0.9
    assert np.isnan(run["motor_torque"][early]).all()
    assert np.isfinite(run["motor_angle"]).all()
    assert np.isfinite(run["motor_torque"][run.time > 1.1]).all()


@pytest.mark.parametrize("suffix", ["csv", "mcap"])
def test_a_bench_without_instruments_has_rows_every_hundredth(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"bare.{suffix}"
    with recording(path, "A") as (fed, recorder):
        pass
    fed.sensors["A"].clear()
    with Recorder(path, fed.sensors, fed.clock, {}, replace=True) as recorder:
        fed.run(recorder, 1.0)
    run = read_run(path)
    assert list(run) == ["motor_angle", "motor_velocity", "motor_torque"]
    assert np.diff(run.time) == pytest.approx(3 * CYCLE, abs=1e-6)


def test_a_log_in_parts_reads_as_one(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with recording(path, "A", rotation=Rotation(size=10_000)) as (fed, recorder):
        for _ in range(4):
            fed.run_until_written(recorder, 1.0)
    assert len(recorder.parts) >= 3
    assert recorder.path == tmp_path / "a.001.mcap"
    log = read_log(path)
    assert len(log.samples["/A/drive"]) == 1000
    assert log.closed


FULL_AT_ONCE = """
import sys
sys.path[:0] = [{tests!r}, {benchmarks!r}]
from fed import Fed, SetClock
from winchkit.bench.recording.recorder import Recorder
(disk / "other").write_bytes(bytes(60_000))
fed = Fed(SetClock())
try:
    Recorder(disk / "a.{suffix}", fed.sensors, fed.clock, {{"profile": "x" * 20_000}})
except Exception as error:
    print(type(error).__name__, error)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="needs a tmpfs of its own")
@pytest.mark.parametrize("suffix", ["csv", "mcap"])
def test_a_disk_that_is_full_from_the_start(tmp_path: Path, suffix: str) -> None:
    folder = SUPPORT
    script = FULL_AT_ONCE.format(tests=folder, benchmarks=BENCHMARKS, suffix=suffix)
    done = run_on_small_disk(tmp_path, script, "64k")
    assert "FileError" in done.stdout, done.stderr
    assert "No space left" in done.stdout
    (tmp_path / f"folder.{suffix}").mkdir()
    with (
        pytest.raises(FileError, match="cannot be written"),
        recording(tmp_path / f"folder.{suffix}"),
    ):
        pytest.fail("it opened")


def test_a_log_that_is_no_format(tmp_path: Path) -> None:
    clock = SetClock()
    with pytest.raises(UsageError, match=r"\.csv, \.mcap"):
        Recorder(tmp_path / "a.txt", {"A": {}}, clock, {})


FILLING = """
import logging, resource, sys
sys.path.insert(0, {tests!r})
from fed import Fed, SetClock
from winchkit.bench.recording.recorder import Recorder
from winchkit.errors import FileError
logging.basicConfig(format="%(message)s")
{limit}
fed = Fed(SetClock())
recorder = Recorder({path}, fed.sensors, fed.clock, {{}})
cycles = 0
while True:
    fed.run(recorder, 0.5)
    cycles += 1
    try:
        recorder.check()
    except FileError as error:
        print("told", error)
        break
    recorder._stopping.wait(0.02)
fed.run(recorder, 5.0)
print("the loop goes on", len(recorder._feed._snapshots))
print("listeners", sum(len(c.listeners) for s in fed.sensors.values() for c in s.values()))
try:
    recorder.close()
except FileError as error:
    print("closed", error)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="file size limits are POSIX")
@pytest.mark.parametrize("suffix", ["csv", "mcap"])
def test_a_disk_that_fills_ends_the_log_and_nothing_else(tmp_path: Path, suffix: str) -> None:
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] != 150_000
    path = tmp_path / f"a.{suffix}"
    limit = "resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, 150_000))"
    script = FILLING.format(tests=SUPPORT, path=repr(str(path)), limit=limit)
    done = own_process(sys.executable, "-c", script, env=os.environ | {"PYTHONPATH": BENCHMARKS})
    assert f"told {path}: cannot be written: File too large" in done.stdout
    assert "listeners 0" in done.stdout
    assert re.search("the loop goes on [01]$", done.stdout, re.MULTILINE), "nothing piles up"
    assert "the log has ended, the bench goes on" in done.stderr
    assert 50_000 < path.stat().st_size <= 150_000
    run = read_run(path)
    angle, whole = run["A.motor_angle"], np.count_nonzero(np.isfinite(run["A.motor_angle"]))
    assert whole > 100
    # The sources of a log by channels end at different times: its last rows lack the drive.
    assert np.isfinite(angle[:whole]).all()
    assert angle[:whole] == pytest.approx(angle[0] + 3 * run.time[:whole], abs=1e-5)


@pytest.mark.skipif(sys.platform != "linux", reason="needs a tmpfs of its own")
@pytest.mark.parametrize("suffix", ["csv", "mcap"])
def test_the_rows_up_to_a_full_disk_can_be_read(tmp_path: Path, suffix: str) -> None:
    """ENOSPC of a real file system; CSV also by Python's own reader."""
    place = f"disk / 'a.{suffix}'"
    script = FILLING.format(tests=SUPPORT, path=place, limit="")
    done = run_on_small_disk(tmp_path, script, "160k", os.environ | {"PYTHONPATH": BENCHMARKS})
    assert f"a.{suffix}: cannot be written: No space left on device" in done.stdout, done.stderr
    assert re.search("the loop goes on [01]$", done.stdout, re.MULTILINE)
    assert "the log has ended, the bench goes on" in done.stderr
    path = tmp_path / f"a.{suffix}"
    run = read_run(path)
    known = np.isfinite(run["A.motor_angle"])
    assert known.sum() > 100
    # The last batch of an MCAP may hold messages of the cell whose drive's were not written.
    assert known[: known.sum()].all(), "what is unknown stands at the end"
    angle, time = run["A.motor_angle"][known], run.time[known]
    assert angle == pytest.approx(angle[0] + 3 * (time - time[0]), abs=1e-5)
    if suffix == "csv":
        with path.open(newline="") as file:
            rows = list(csv.reader(line for line in file if not line.startswith("#")))
        assert len(rows) == len(run) + 1
        assert {len(row) for row in rows} == {len(rows[0])}
        assert path.read_bytes().endswith(b"\n")


def test_an_event_is_reported_when_a_log_ends(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    clock = SetClock()
    fed = Fed(clock)
    recorder = Recorder(tmp_path / "a.mcap", fed.sensors, clock, {})
    with caplog.at_level(logging.ERROR):
        fed.run(recorder, 0.5)
        recorder._syncer.error = OSError(5, "Input/output error")
        recorder._thread.join(10.0)
    assert "the log has ended, the bench goes on" in caplog.text
    fed.run(recorder, 0.5)
    for told in (recorder.check, recorder.close):
        with pytest.raises(FileError, match="the disk refuses it: Input/output error"):
            told()
    recorder.close()


def test_what_is_not_taken_is_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("winchkit.bench.recording.feed._WAITING", 100)
    with recording(tmp_path / "a.mcap", "A") as (fed, recorder):
        while recorder.counters()["log"]["drops"] == 0:
            fed.run(recorder, 1.0)
    log = read_log(tmp_path / "a.mcap")
    lost = recorder.counters()["log"]["drops"]
    assert len(log.samples["/A/drive"]) == pytest.approx(fed.cycle - lost, abs=3)


MOMENTS = random.Random(7)
LOSS = {"mcap": 0.3, "csv": 0.3}
"""s"""


@pytest.mark.realtime
@pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL is POSIX")
@pytest.mark.parametrize(
    ("moment", "rotate", "suffix"),
    [
        (MOMENTS.uniform(0, 1.5), rotate, suffix)
        for suffix in ("mcap", "csv")
        for rotate in (None, "1s", None, "10kB", None)
    ],
)
def test_a_killed_recording_loses_little_and_is_recovered(
    tmp_path: Path, moment: float, rotate: str | None, suffix: str
) -> None:
    """Whole to the last flush, as the package ``mcap`` and Python's own csv reader find it."""
    killed = kill_once(tmp_path, moment, rotate, suffix)
    assert killed.lost <= LOSS[suffix]
    assert killed.gaps == 0
    assert killed.whole
    assert killed.recovered
