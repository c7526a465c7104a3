"""Runs in MCAP and the row by row writers: what was flushed outlives its process."""

from __future__ import annotations

import errno
import json
import math
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

from small_disk import run_on_small_disk
from winchkit.errors import FileError, RunError, UsageError
from winchkit.runs import Run, open_writer, read_run, write_run

COLUMNS = [("time", "s"), ("motor_angle", "rad"), ("tension", "N"), ("valve", "bar")]


def rows_of(count: int) -> Iterator[dict[str, float]]:
    for n in range(count):
        angle = math.sin(n) if n % 5 else math.nan
        yield {"time": n * 0.1, "motor_angle": angle, "tension": n / 3}


def written(path: Path, count: int) -> Run:
    with open_writer(path, COLUMNS, {"load_mass": "15 kg"}) as writer:
        for row in rows_of(count):
            writer.append(row)
    return read_run(path)


@pytest.mark.parametrize("suffix", ["csv", "mcap"])
def test_what_is_appended_reads_back(tmp_path: Path, suffix: str) -> None:
    run = written(tmp_path / f"a.{suffix}", 20)
    rows = list(rows_of(20))
    assert run.time.tolist() == [row["time"] for row in rows]
    expected = [row["motor_angle"] for row in rows]
    assert np.array_equal(run["motor_angle"], expected, equal_nan=True)
    assert run["tension"].tolist() == [row["tension"] for row in rows]
    assert np.isnan(run["valve"]).all()
    assert run.channels["valve"].unit == "bar"
    assert dict(run.metadata) == {"load_mass": "15 kg"}
    assert run.notes == ()


def test_both_formats_hold_the_same(tmp_path: Path) -> None:
    first = written(tmp_path / "a.csv", 50)
    write_run(first, tmp_path / "b.mcap")
    second = read_run(tmp_path / "b.mcap")
    write_run(second, tmp_path / "c.csv")
    assert (tmp_path / "c.csv").read_text() == (tmp_path / "a.csv").read_text()


def test_another_reader_finds_rows_units_and_metadata(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    written(path, 6)
    with path.open("rb") as stream:
        reader = make_reader(stream)
        found = list(reader.iter_messages())
        records = {record.name: dict(record.metadata) for record in reader.iter_metadata()}
    schema, channel, message = found[3]
    assert (schema.encoding, channel.message_encoding, channel.topic) == (
        "jsonschema",
        "json",
        "run",
    )
    assert json.loads(schema.data)["properties"]["tension"]["unit"] == "N"
    assert json.loads(found[5][2].data)["motor_angle"] is None
    assert json.loads(message.data)["tension"] == 1.0
    assert message.log_time == 300_000_000
    assert records["winchkit.columns"] == dict(COLUMNS)
    assert records["winchkit.metadata"] == {"load_mass": "15 kg"}


def test_a_file_cut_anywhere_keeps_every_whole_row(tmp_path: Path) -> None:
    path, cut = tmp_path / "a.mcap", tmp_path / "cut.mcap"
    ends = []
    with open_writer(path, COLUMNS) as writer:
        for row in rows_of(12):
            writer.append(row)
            writer.flush()
            ends.append(path.stat().st_size)
    data = path.read_bytes()
    for length in range(ends[1], len(data), 7):
        cut.write_bytes(data[:length])
        run = read_run(cut)
        assert len(run) == sum(end <= length for end in ends)
        assert f"its {len(run)} whole rows are read" in run.notes[0]


def test_a_file_cut_before_its_rows_is_no_run(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    written(path, 3)
    data = path.read_bytes()
    start = data.index(b'{"time":0.0')
    for length in range(0, start, 5):
        path.write_bytes(data[:length])
        with pytest.raises(RunError):
            read_run(path)


def test_damage_is_no_cut(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    stream = BytesIO()
    writer = Writer(stream)
    writer.start()
    schema = writer.register_schema("r", "jsonschema", b"{}")
    channel = writer.register_channel("run", "json", schema)
    writer.add_metadata("winchkit.columns", {"time": "s", "motor_angle": "rad"})
    for n in range(20):
        writer.add_message(channel, n, b'{"time": %d, "motor_angle": 1}' % n, n)
    writer.finish()  # type: ignore[no-untyped-call]
    path.write_bytes(stream.getvalue())
    assert len(read_run(path)) == 20
    data = bytearray(stream.getvalue())
    data[data.index(b"\x28\xb5\x2f\xfd") + 12] ^= 0xFF  # within the zstandard frame
    path.write_bytes(data)
    with pytest.raises(RunError, match="damaged after 0 rows"):
        read_run(path)


def test_a_changed_digit_is_found_by_the_checksum(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    written(path, 10)
    data = path.read_bytes()
    path.write_bytes(data.replace(b'"tension":1.0', b'"tension":7.0'))
    assert path.read_bytes() != data
    with pytest.raises(RunError, match="damaged"):
        read_run(path)


@pytest.mark.parametrize(
    ("message", "part"),
    [
        (b'{"time": 0, "motor_angle": "x"}', "row 2 is no JSON object of numbers"),
        (b"[1, 2]", "row 2"),
        (b"not json", "row 2"),
        (b'{"time": 0, "motor_angle": true}', "row 2"),
        (b'{"time": 0, "motor_angle": 1}', "time stands still"),
        (b'{"motor_angle": 1}', "time is missing"),
        (b'{"time": 5, "motor_angle": Infinity}', "infinite"),
    ],
)
def test_rows_that_are_none(tmp_path: Path, message: bytes, part: str) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel("run", "json", 0)
        writer.add_metadata("winchkit.columns", {"time": "s", "motor_angle": "rad"})
        writer.add_message(channel, 0, b'{"time": 0, "motor_angle": 1}', 0)
        writer.add_message(channel, 0, message, 0)
        writer.finish()  # type: ignore[no-untyped-call]
    with pytest.raises(RunError, match=part):
        read_run(path)


def test_an_mcap_of_something_else(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        writer.register_channel("/camera", "ros1", 0)
        writer.finish()  # type: ignore[no-untyped-call]
    with pytest.raises(RunError, match=r"has no run.*/camera"):
        read_run(path)
    path.write_bytes(b"time [s],motor_angle [rad]\n")
    with pytest.raises(RunError, match="not an MCAP file"):
        read_run(path)


@pytest.mark.parametrize(("suffix", "interval"), [("csv", 0.5), ("mcap", 0.25)])
def test_rows_wait_no_longer_than_promised(tmp_path: Path, suffix: str, interval: float) -> None:
    """With a clock of our own: after each append, every row older than the interval is readable."""
    now = 0.0
    path, copy = tmp_path / f"a.{suffix}", tmp_path / f"copy.{suffix}"
    writer = open_writer(path, COLUMNS, clock=lambda: now)
    for n, row in enumerate(rows_of(100)):
        now = n * 0.02
        writer.append(row)
        due = sum(k * 0.02 <= now - interval for k in range(100))
        if due >= 2 and n % 7 == 0:
            copy.write_bytes(path.read_bytes())
            assert len(read_run(copy)) >= due
    writer.close()
    assert len(read_run(path)) == 100


@pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL is POSIX")
@pytest.mark.parametrize("suffix", ["csv", "mcap"])
def test_a_killed_process_loses_only_what_was_not_flushed(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a.{suffix}"
    script = f"""
import os, signal
from winchkit.runs import open_writer
now = 0.0
writer = open_writer({str(path)!r}, {COLUMNS!r}, {{"load_mass": "1 kg"}}, clock=lambda: now)
for n in range(2000):
    now = n * 0.001
    writer.append({{"time": now, "motor_angle": n, "tension": 0.123456789012345678}})
os.kill(os.getpid(), signal.SIGKILL)
"""
    process = subprocess.run([sys.executable, "-c", script], check=False, timeout=60)
    assert process.returncode == -signal.SIGKILL
    lost = {"csv": 500, "mcap": 250}[suffix]
    run = read_run(path)
    assert 2000 - lost <= len(run) <= 2000
    assert set(run["tension"]) == {0.123456789012345678}
    assert run["motor_angle"].tolist() == list(range(len(run)))
    assert run.load_mass == 1.0


@pytest.mark.parametrize("suffix", ["csv", "mcap"])
def test_what_a_writer_refuses(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a.{suffix}"
    with open_writer(path, COLUMNS) as writer:
        with pytest.raises(UsageError, match="did you mean 'tension'"):
            writer.append({"time": 0.0, "tensoin": 1.0})
        writer.append({"time": 0.0, "motor_angle": math.inf})
        writer.append({"time": 1.0, "motor_angle": 1.0})
    with pytest.raises(UsageError, match="is closed"):
        writer.append({"time": 2.0})
    writer.flush()
    writer.close()
    assert np.isnan(read_run(path)["motor_angle"]).tolist() == [True, False]
    with pytest.raises(UsageError, match="'time'"):
        open_writer(path, COLUMNS[1:])
    with pytest.raises(UsageError, match=r"use one of \.csv, \.mcap"):
        open_writer(tmp_path / "a.txt", COLUMNS)
    with pytest.raises(FileError, match="cannot be written"):
        open_writer(tmp_path / "nowhere" / path.name, COLUMNS)


FULL = """
from winchkit.runs import open_writer
from winchkit.errors import FileError
rows = 0
writer = open_writer(disk / "a.{suffix}", [("time", "s"), ("motor_angle", "rad")])
try:
    while True:
        writer.append({{"time": rows * 0.01, "motor_angle": rows / 3}})
        rows += 1
        if rows % 50 == 0:
            writer.flush()
            flushed = rows
except FileError as error:
    print(flushed, error)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="needs a tmpfs of its own")
@pytest.mark.parametrize("suffix", ["csv", "mcap"])
def test_a_full_disk_is_reported_and_keeps_what_was_flushed(tmp_path: Path, suffix: str) -> None:
    done = run_on_small_disk(tmp_path, FULL.format(suffix=suffix), "64k")
    assert os.strerror(errno.ENOSPC) in done.stdout, done.stderr
    run = read_run(tmp_path / f"a.{suffix}")
    assert len(run) == int(done.stdout.split()[0])
    assert run["motor_angle"].tolist() == [n / 3 for n in range(len(run))]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
@pytest.mark.parametrize("suffix", ["csv", "mcap"])
def test_a_run_is_written_to_a_regular_file_only(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a.{suffix}"
    path.symlink_to("/dev/full")
    with pytest.raises(FileError, match="a character device, not a regular file"):
        written(path, 5)
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(FileError, match="a FIFO, not a regular file"):
        written(path, 5)
