"""Records beside a bench file, by their bytes: trips that outlive the process, and positions."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from small_disk import run_on_small_disk
from winchkit.bench.control.snapshot import Trip
from winchkit.bench.records.latch import LatchFile
from winchkit.bench.records.position_file import PositionFile
from winchkit.drivers.can.cia402.motor_position import KeptPosition
from winchkit.errors import NotPermitted

KEPT = KeptPosition(-705_799, 1 << 32, -3, "", True, 77, {(0x1A00, 1): 0x60410010, (0x1017, 0): 50})
_positions = st.builds(
    KeptPosition,
    count=st.integers(-(2**31), 2**32 - 1),
    offset=st.integers(-(2**40), 2**40),
    zero=st.integers(-(2**40), 2**40),
    doubt=st.text(max_size=300),
    closed=st.booleans(),
    serial=st.integers(0, 2**32 - 1),
    objects=st.dictionaries(
        st.tuples(st.integers(0, 0xFFFF), st.integers(0, 255)),
        st.integers(-(2**31), 2**32 - 1),
        max_size=40,
    ),
    unit=st.floats(-1.0, 1.0),
    trim=st.floats(-10.0, 10.0),
)


def no_file_of_ours(path: Path, kind: str) -> Path:
    """A folder, a pipe or a link in the place of a record, or its place without a folder."""
    if kind == "folder":
        path.mkdir()
    elif kind == "fifo":
        os.mkfifo(path)
    elif kind == "link":
        path.symlink_to(path.parent / "elsewhere")
    else:
        path = path.parent / "missing" / path.name
    return path


def opened(path: Path) -> tuple[PositionFile, list[str]]:
    file = PositionFile(str(path))
    return file, [trip.kind for trip in file.open()]


@given(st.dictionaries(st.text("ABCDEFGH", min_size=1, max_size=3), _positions, max_size=8))
def test_what_is_kept_is_found(
    tmp_path_factory: pytest.TempPathFactory, positions: dict[str, KeptPosition]
) -> None:
    """In place, and by a new file at the close; one that is open is a trip."""
    path = tmp_path_factory.mktemp("record") / "bench.position.json"
    for closing in (False, True):
        first, _ = opened(path)
        (first.close_with if closing else first.keep)(positions)
        first.close()
        again, trips = opened(path)
        assert again.found == positions
        assert trips == ["owner"] * sum(not kept.closed for kept in positions.values())
        again.close()
        path.unlink()


def test_a_shorter_record_leaves_nothing_of_a_longer_one(tmp_path: Path) -> None:
    path = tmp_path / "bench.position.json"
    file, _ = opened(path)
    long = {f"W{number}": KEPT for number in range(60)}
    assert file.keep(long) is None
    assert path.stat().st_size > 8192
    assert file.keep({"W0": KeptPosition(1)}) is None
    file.close()
    assert opened(path)[0].found == long | {"W0": KeptPosition(1)}


@given(content=st.binary(max_size=200) | st.text(max_size=100).map(str.encode))
def test_what_cannot_be_read_is_a_trip_and_no_position(
    tmp_path_factory: pytest.TempPathFactory, content: bytes
) -> None:
    path = tmp_path_factory.mktemp("record") / "bench.position.json"
    path.write_bytes(content)
    file, trips = opened(path)
    assert trips == ["position record"]
    assert file.found == {}


def test_a_record_cut_anywhere_is_no_position(tmp_path: Path) -> None:
    """As after a power failure while it was written."""
    path = tmp_path / "bench.position.json"
    file, _ = opened(path)
    file.keep({"A": KEPT})
    data = path.read_bytes()
    for size in (0, 1, 100, len(data.rstrip()) - 1):
        path.write_bytes(data[:size])
        assert opened(path)[0].found == {}, size


def test_a_record_that_somebody_removed_is_written_anew(tmp_path: Path) -> None:
    path = tmp_path / "bench.position.json"
    file, _ = opened(path)
    os.unlink(path)
    assert file.keep({"A": KEPT}) is None
    assert opened(path)[0].found == {"A": KEPT}


@pytest.mark.parametrize("kind", ["folder", "fifo", "link", "missing"])
def test_what_is_no_file_of_ours_is_a_trip(tmp_path: Path, kind: str) -> None:
    path = no_file_of_ours(tmp_path / "bench.position.json", kind)
    assert opened(path)[1] == ["position record"]


def test_without_a_path_nothing_is_kept() -> None:
    file = PositionFile("")
    assert file.open() == ()
    assert file.keep({"A": KEPT}) is None
    assert file.found == {}


def test_a_full_disk_is_a_trip_and_leaves_no_draft(tmp_path: Path) -> None:
    script = """
from winchkit.bench.records.position_file import PositionFile
(disk / "logs").write_bytes(bytes(4096))
trips = PositionFile(str(disk / "bench.position.json")).open()
print([trip.kind for trip in trips], [file.name for file in disk.iterdir()])
"""
    done = run_on_small_disk(tmp_path, script, "8k")
    assert done.stdout == "['position record'] ['logs']\n", done.stderr


TRIP = Trip("state", "A", "the drive left operation enabled", latches=True)


def opened_latch(path: Path) -> tuple[LatchFile, tuple[Trip, ...]]:
    latch = LatchFile(str(path))
    return latch, latch.open()


def test_a_trip_stands_in_the_next_process_until_it_is_cleared(tmp_path: Path) -> None:
    path = tmp_path / "bench.trip.json"
    first, trips = opened_latch(path)
    assert trips == ()
    assert first.keep([TRIP]) is None
    record = json.loads(path.read_text())
    assert record["tripped"][0]["winch"] == "A"
    assert record["tripped"][0]["time"].startswith("20")
    first.close()
    second, trips = opened_latch(path)
    assert [trip.kind for trip in trips] == ["state"]
    assert record["tripped"][0]["time"] in trips[0].message
    second.clear()
    second.close()
    assert not path.exists()
    assert opened_latch(path)[1] == ()


def test_a_trip_that_was_not_closed_stands_too(tmp_path: Path) -> None:
    """As after SIGKILL: the record is whole without any closing."""
    path = tmp_path / "bench.trip.json"
    latch, _ = opened_latch(path)
    latch.keep([TRIP])
    assert [trip.kind for trip in opened_latch(path)[1]] == ["state"]


@given(content=st.binary(max_size=200) | st.text(max_size=100).map(str.encode))
def test_a_file_that_cannot_be_read_counts_as_latched(
    tmp_path_factory: pytest.TempPathFactory, content: bytes
) -> None:
    path = tmp_path_factory.mktemp("latch") / "bench.trip.json"
    path.write_bytes(content)
    _, trips = opened_latch(path)
    assert trips
    assert trips[0].kind == "latch file"


def test_a_cut_record_counts_as_latched(tmp_path: Path) -> None:
    path = tmp_path / "bench.trip.json"
    latch, _ = opened_latch(path)
    latch.keep([TRIP])
    data = path.read_bytes()
    for size in (0, 1, len(data) // 2, len(data) - 1):
        path.write_bytes(data[:size])
        assert opened_latch(path)[1], size


@pytest.mark.parametrize("kind", ["folder", "fifo", "link", "missing"])
def test_what_is_no_file_of_ours_counts_as_latched(tmp_path: Path, kind: str) -> None:
    path = no_file_of_ours(tmp_path / "bench.trip.json", kind)
    latch, trips = opened_latch(path)
    assert trips[0].kind == "latch file"
    if kind == "missing":
        with pytest.raises(NotPermitted, match=r"bench\.trip\.json"):
            latch.clear()


def test_a_full_disk_takes_the_trip_in_place(tmp_path: Path) -> None:
    """The record has its full size from opening on: a trip allocates nothing."""
    path = tmp_path / "bench.trip.json"
    latch, _ = opened_latch(path)
    size, blocks = path.stat().st_size, path.stat().st_blocks
    latch.keep([TRIP] * 40)
    assert (path.stat().st_size, path.stat().st_blocks) == (size, blocks)


@given(words=st.text(max_size=2000), count=st.integers(1, 40))
def test_any_words_leave_a_record_that_can_be_read(
    tmp_path_factory: pytest.TempPathFactory, words: str, count: int
) -> None:
    path = tmp_path_factory.mktemp("latch") / "bench.trip.json"
    latch, _ = opened_latch(path)
    assert latch.keep([Trip(f"kind {n}", "A", words) for n in range(count)]) is None
    _, trips = opened_latch(path)
    assert trips
    assert trips[0].kind == "kind 0"
