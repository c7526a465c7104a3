"""Trips outlive the process: the latch file, by its bytes."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.bench.control.snapshot import Trip
from winchkit.bench.records.latch import LatchFile
from winchkit.errors import NotPermitted

TRIP = Trip("state", "A", "the drive left operation enabled", latches=True)


def opened(path: Path) -> tuple[LatchFile, tuple[Trip, ...]]:
    latch = LatchFile(str(path))
    return latch, latch.open()


def test_a_trip_stands_in_the_next_process_until_it_is_cleared(tmp_path: Path) -> None:
    path = tmp_path / "bench.trip.json"
    first, trips = opened(path)
    assert trips == ()
    assert first.keep([TRIP]) is None
    record = json.loads(path.read_text())
    assert record["tripped"][0]["winch"] == "A"
    assert record["tripped"][0]["time"].startswith("20")
    first.close()
    second, trips = opened(path)
    assert [trip.kind for trip in trips] == ["state"]
    assert record["tripped"][0]["time"] in trips[0].message
    second.clear()
    second.close()
    assert not path.exists()
    assert opened(path)[1] == ()


def test_a_trip_that_was_not_closed_stands_too(tmp_path: Path) -> None:
    """As after SIGKILL: the record is whole without any closing."""
    path = tmp_path / "bench.trip.json"
    latch, _ = opened(path)
    latch.keep([TRIP])
    assert [trip.kind for trip in opened(path)[1]] == ["state"]


@given(content=st.binary(max_size=200) | st.text(max_size=100).map(str.encode))
def test_a_file_that_cannot_be_read_counts_as_latched(
    tmp_path_factory: pytest.TempPathFactory, content: bytes
) -> None:
    path = tmp_path_factory.mktemp("latch") / "bench.trip.json"
    path.write_bytes(content)
    _, trips = opened(path)
    assert trips
    assert trips[0].kind == "latch file"


def test_a_cut_record_counts_as_latched(tmp_path: Path) -> None:
    path = tmp_path / "bench.trip.json"
    latch, _ = opened(path)
    latch.keep([TRIP])
    data = path.read_bytes()
    for size in (0, 1, len(data) // 2, len(data) - 1):
        path.write_bytes(data[:size])
        assert opened(path)[1], size


@pytest.mark.parametrize("kind", ["folder", "fifo", "link", "unwritable"])
def test_what_is_no_file_of_ours_counts_as_latched(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "bench.trip.json"
    if kind == "folder":
        path.mkdir()
    elif kind == "fifo":
        os.mkfifo(path)
    elif kind == "link":
        path.symlink_to(tmp_path / "elsewhere")
    else:
        path = tmp_path / "missing" / "bench.trip.json"
    latch, trips = opened(path)
    assert trips[0].kind == "latch file"
    if kind == "unwritable":
        with pytest.raises(NotPermitted, match=r"bench\.trip\.json"):
            latch.clear()


def test_a_full_disk_takes_the_trip_in_place(tmp_path: Path) -> None:
    """The record has its full size from opening on: a trip allocates nothing."""
    path = tmp_path / "bench.trip.json"
    latch, _ = opened(path)
    size, blocks = path.stat().st_size, path.stat().st_blocks
    latch.keep([TRIP] * 40)
    assert (path.stat().st_size, path.stat().st_blocks) == (size, blocks)


@given(words=st.text(max_size=2000), count=st.integers(1, 40))
def test_any_words_leave_a_record_that_can_be_read(
    tmp_path_factory: pytest.TempPathFactory, words: str, count: int
) -> None:
    path = tmp_path_factory.mktemp("latch") / "bench.trip.json"
    latch, _ = opened(path)
    assert latch.keep([Trip(f"kind {n}", "A", words) for n in range(count)]) is None
    _, trips = opened(path)
    assert trips
    assert trips[0].kind == "kind 0"
