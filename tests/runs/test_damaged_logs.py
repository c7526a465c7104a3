"""Readers of logs against damage: nothing but our own errors, and no hang, whatever the bytes."""

from __future__ import annotations

import struct
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from logs import written
from winchkit.errors import FileError
from winchkit.runs import open_writer, read_run
from winchkit.runs.info import info_of
from winchkit.runs.read import read_log
from winchkit.runs.recover import recover

CALM = settings(
    max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


@cache
def sample(kind: str) -> bytes:
    """A file of each kind to be damaged."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"a.{kind.rpartition('.')[2]}"
        if kind == "rows.mcap":
            with open_writer(path, [("time", "s"), ("motor_angle", "rad")]) as writer:
                for n in range(8):
                    writer.append({"time": n, "motor_angle": 1.5})
        else:
            written(path, 0.3)
        return path.read_bytes()


def survives(path: Path) -> None:
    """Everything that reads a file either reads it or says what is wrong."""
    readers: tuple[Callable[[], object], ...] = (
        lambda: read_run(path),
        lambda: info_of(read_log(path)),
        lambda: read_log(recover(path, path.with_name(f"saved{path.suffix}"), replace=True).output),
    )
    for reader in readers:
        with suppress(FileError):
            reader()


def changed(data: bytes, edits: list[tuple[float, bytes]], cut: float) -> bytes:
    damaged = bytearray(data)
    for place, new in edits:
        at = int(place * len(damaged))
        damaged[at : at + len(new)] = new
    return bytes(damaged[: int(cut * len(damaged)) + 1])


EDITS = st.lists(
    st.tuples(
        st.floats(0, 0.999),
        st.binary(min_size=1, max_size=12)
        | st.sampled_from([struct.pack("<Q", n) for n in (0, 1, 2**31, 2**62, 2**64 - 1)]),
    ),
    max_size=4,
)


@pytest.mark.parametrize("kind", ["log.mcap", "rows.mcap", "log.csv"])
@CALM
@given(edits=EDITS, cut=st.floats(0, 1) | st.just(1.0))
def test_no_damage_brings_the_readers_down(
    tmp_path: Path, kind: str, edits: list[tuple[float, bytes]], cut: float
) -> None:
    path = tmp_path / kind
    path.write_bytes(changed(sample(kind), edits, cut))
    survives(path)


@pytest.mark.parametrize("suffix", ["mcap", "csv"])
@CALM
@given(data=st.binary(max_size=400))
def test_no_bytes_bring_the_readers_down(tmp_path: Path, suffix: str, data: bytes) -> None:
    path = tmp_path / f"x.{suffix}"
    path.write_bytes((b"\x89MCAP0\r\n" if suffix == "mcap" else b"") + data)
    survives(path)


RECORD = st.tuples(st.integers(0, 16), st.binary(max_size=60))


@CALM
@given(items=st.lists(RECORD, max_size=8))
def test_no_records_bring_the_readers_down(tmp_path: Path, items: list[tuple[int, bytes]]) -> None:
    path = tmp_path / "x.mcap"
    body = b"".join(struct.pack("<BQ", op, len(data)) + data for op, data in items)
    whole = sample("log.mcap")
    begin = whole.index(b"\x06", whole.index(b"clock_offset") + 20)
    path.write_bytes(whole[:begin] + body)
    survives(path)


@CALM
@given(items=st.lists(RECORD, max_size=8), tail=st.binary(max_size=12))
def test_no_content_of_a_chunk_brings_the_readers_down(
    tmp_path: Path, items: list[tuple[int, bytes]], tail: bytes
) -> None:
    path = tmp_path / "x.mcap"
    inner = b"".join(struct.pack("<BQ", op, len(data)) + data for op, data in items) + tail
    # Neither packed nor with a checksum, so that the readers come to see what is in it.
    chunk = struct.pack("<QQQIIQ", 0, 0, len(inner), 0, 0, len(inner)) + inner
    whole = sample("log.mcap")
    begin = whole.index(b"\x06", whole.index(b"clock_offset") + 20)
    path.write_bytes(whole[:begin] + struct.pack("<BQ", 6, len(chunk)) + chunk)
    survives(path)
