"""Logs on the disk: in parts that read as one file would, and synced from another thread."""

from __future__ import annotations

import errno
import os
import threading
from pathlib import Path

import numpy as np
import pytest

from logs import CELL, DRIVE, LAYOUT, OPENED, between, samples_until, written
from winchkit.errors import RunError, UsageError
from winchkit.runs import read_run
from winchkit.runs.read import read_log
from winchkit.runs.recording.open_log import open_log
from winchkit.runs.recording.rotation import Rotation, part_path, parts_beside
from winchkit.runs.recording.sync import SYNC_PERIOD, Syncer

SECOND = Rotation(duration=1.05)


@pytest.mark.parametrize(
    ("text", "size", "duration"),
    [
        ("100MB", 100e6, np.inf),
        ("1.5 GB", 1.5e9, np.inf),
        ("10kB", 10e3, np.inf),
        ("10min", np.inf, 600.0),
        (" 2 h ", np.inf, 7200.0),
        ("1s", np.inf, 1.0),
    ],
)
def test_limits_as_people_write_them(text: str, size: float, duration: float) -> None:
    assert Rotation.parse(text) == Rotation(size, duration)


@pytest.mark.parametrize("text", ["", "5", "5 parsec", "1 kB", "0.1s", "-3MB", "..MB", "nan MB"])
def test_limits_that_cannot_be_meant(text: str) -> None:
    with pytest.raises(UsageError):
        Rotation.parse(text)


def test_names_of_parts(tmp_path: Path) -> None:
    path = tmp_path / "lift.one.mcap"
    assert part_path(path, 7).name == "lift.one.007.mcap"
    for number in (2, 1, 1000):
        part_path(path, number).touch()
    for other in ("lift.one.mcap.bak", "lift.one.x01.mcap", "lift.two.001.mcap", "lift.001.mcap"):
        (tmp_path / other).touch()
    assert parts_beside(path) == [part_path(path, number) for number in (1, 2, 1000)]


@pytest.mark.parametrize("suffix", ["csv", "mcap"])
def test_parts_read_alone_and_together(tmp_path: Path, suffix: str) -> None:
    written(tmp_path / f"one.{suffix}", duration=3.0)
    parts = written(tmp_path / f"many.{suffix}", 3.0, SECOND)
    assert [part.name for part in parts] == [f"many.00{n}.{suffix}" for n in (1, 2, 3)]
    whole, together = read_run(tmp_path / f"one.{suffix}"), read_run(tmp_path / f"many.{suffix}")
    assert len(together) == len(whole)
    assert together.time == pytest.approx(whole.time, abs=2e-9)
    for name in whole:
        assert together[name] == pytest.approx(whole[name], abs=1e-8, nan_ok=True)
    alone = [read_run(part) for part in parts]
    assert [run.metadata["part"] for run in alone] == ["1", "2", "3"]
    assert sum(map(len, alone)) >= len(whole) - 4
    for run in alone:
        shared = np.isin(np.round(whole.time, 6), np.round(run.time, 6))
        assert shared.sum() == len(run), "time goes on from part to part"
    log = read_log(parts)
    assert log.closed is (True if suffix == "mcap" else None)


def test_parts_by_size(tmp_path: Path) -> None:
    parts = written(tmp_path / "many.mcap", 4.0, Rotation(size=20_000))
    assert len(parts) >= 3
    assert all(20_000 <= part.stat().st_size < 32_000 for part in parts[:-1])
    sources = read_log(tmp_path / "many.mcap").samples
    assert (len(sources[DRIVE]), len(sources[CELL])) == (1000, 200)
    assert np.diff(sources[DRIVE].times) == pytest.approx(4e-3, abs=1e-6)


def test_a_last_part_that_was_never_started_is_left_out(tmp_path: Path) -> None:
    for suffix, bare in (("mcap", b"\x89MCAP0\r\n\x01\x18"), ("csv", b"# a: b\ntime [s],x")):
        parts = written(tmp_path / f"many.{suffix}", 2.5, SECOND)
        whole = read_run(tmp_path / f"many.{suffix}")
        for data in (b"", bare):
            part_path(tmp_path / f"many.{suffix}", len(parts) + 1).write_bytes(data)
            assert len(read_run(tmp_path / f"many.{suffix}")) == len(whole)


@pytest.mark.parametrize("suffix", ["csv", "mcap"])
def test_events_that_wait_are_kept_where_a_part_ends(tmp_path: Path, suffix: str) -> None:
    """Two events since the last write, in which the part becomes full."""
    log = open_log(tmp_path / f"many.{suffix}", LAYOUT, {}, SECOND)
    pieces = samples_until(OPENED + 2.0)
    log.write(between(pieces, OPENED, OPENED + 1.0), OPENED + 1.0)
    for number in (1, 2):
        log.add_event(OPENED + 1.0 + number / 10, {"tripped": [str(number)]})
    log.write(between(pieces, OPENED + 1.0, OPENED + 2.0), OPENED + 2.0)
    log.close({})
    events = read_log(log.parts).events
    assert len(log.parts) == 2
    assert [note.value["tripped"] for note in events] == [["1"], ["2"]]


def test_a_last_part_cut_anywhere_costs_nothing_but_itself(tmp_path: Path) -> None:
    *others, last = written(tmp_path / "many.csv", 2.5, SECOND)
    data = last.read_bytes()
    before = sum(len(read_run(part)) for part in others)
    for length in range(0, len(data), 41):
        last.write_bytes(data[:length])
        whole = data[: data[:length].rfind(b"\n") + 1].splitlines()
        rows = max(sum(not line.startswith(b"#") for line in whole) - 1, 0)
        assert len(read_run(tmp_path / "many.csv")) == before + rows


def test_a_part_without_rows_is_a_part(tmp_path: Path) -> None:
    """A part that ended before an instrument gave its first reading."""
    parts = written(tmp_path / "many.csv", 3.0, SECOND)
    whole = read_run(tmp_path / "many.csv")
    kept = len(read_run(parts[0])), len(read_run(parts[2]))
    head = [line for line in parts[1].read_bytes().splitlines(keepends=True) if line[:1] in b"#t"]
    parts[1].write_bytes(b"".join(head))
    run = read_run(tmp_path / "many.csv")
    assert len(run) == sum(kept) < len(whole)


def test_parts_of_different_logs_are_not_joined(tmp_path: Path) -> None:
    written(tmp_path / "a.mcap", 1.0)
    written(tmp_path / "b.csv", 1.0)
    with pytest.raises(RunError, match="not a part of the same log"):
        read_log([tmp_path / "a.mcap", tmp_path / "b.csv"])
    with pytest.raises(RunError, match="no such file"):
        read_run(tmp_path / "none.mcap")


def test_recordings_of_one_time_are_no_parts_of_one_log(tmp_path: Path) -> None:
    """Their rows would be interleaved, or those of one of them lost."""
    written(tmp_path / "a.csv", 1.0)
    written(tmp_path / "b.csv", 1.0)
    with pytest.raises(RunError, match=r"before .*a\.csv ends .*one by one"):
        read_log([tmp_path / "a.csv", tmp_path / "b.csv"])


def test_the_promise_is_kept_by_the_period() -> None:
    assert SYNC_PERIOD <= 1.0


def test_every_file_is_synced_by_another_thread(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[tuple[int, int]] = []
    monkeypatch.setattr(
        os, "fsync", lambda fd: synced.append((os.fstat(fd).st_ino, threading.get_ident()))
    )
    syncer = Syncer()
    files = [(tmp_path / name).open("wb") for name in "ab"]
    nodes = [os.fstat(file.fileno()).st_ino for file in files]
    for file in files:
        syncer.watch(file.fileno())
        file.close()
    syncer.close()
    assert {node for node, _ in synced} == set(nodes)
    assert threading.get_ident() not in {thread for _, thread in synced}
    assert syncer.error is None


@pytest.mark.parametrize(("number", "kept"), [(errno.EIO, True), (errno.EINVAL, False)])
def test_an_input_output_error_is_kept_and_a_missing_fsync_is_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, kept: bool
) -> None:
    def fsync(_descriptor: int) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "fsync", fsync)
    syncer = Syncer()
    with (tmp_path / "a").open("wb") as file:
        syncer.watch(file.fileno())
    syncer.close()
    assert (syncer.error is not None) is kept


def test_no_descriptor_is_left_open(tmp_path: Path) -> None:
    before = len(os.listdir("/proc/self/fd")) if os.path.isdir("/proc/self/fd") else 0
    syncer = Syncer()
    with (tmp_path / "a").open("wb") as file:
        for _ in range(20):
            syncer.watch(file.fileno())
    syncer.close()
    after = len(os.listdir("/proc/self/fd")) if os.path.isdir("/proc/self/fd") else 0
    assert after == before
