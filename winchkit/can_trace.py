"""Traces of CAN frames: candump in its three forms, PCAN TRC, Vector ASC and BLF, and CSV."""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice, pairwise
from pathlib import Path

from winchkit.can_trace_lines import (
    READERS,
    SECONDS,
    TraceLine,
    asc,
    base_of,
    csv_head,
    general,
    identifier_of,
    is_marked,
)
from winchkit.errors import Fault, FileError
from winchkit.regular_file import read_whole, regular

TRACED = 20_000
"""Bytes in which a trace is recognised."""
TRACE = (
    "is a trace of CAN frames, whose numbers are in the bytes of the frames: `winchkit log decode "
    "FILE --device D` prints them in words, and `winchkit import FILE --device D` makes a run of "
    "them, where D is the device's EDS or device file; or decode it first by another program to a "
    "table with a column for each signal"
)
LARGEST = 200_000_000
"""Bytes of a trace: some million frames, which are held in memory."""

_SAMPLED = 200
"""Lines by which a trace is recognised; its header has fewer."""
_FEWEST = 3
"""Frames that make a text a trace: one or two may look alike by chance."""
_SHARE = 0.7
"""Share of the lines from the first frame on that are frames; others are events and comments."""
_SHOWN = 60
"""Characters of a line that are shown in a note."""


@dataclass(frozen=True)
class TraceFrame:
    """A data frame of a trace."""

    line: int
    """Line of the file, or number of the frame where it has no lines."""
    time: float
    """s; NaN where the trace has no times."""
    identifier: int
    data: bytes
    bus: str = ""


@dataclass(frozen=True)
class CanTrace:
    """Content of a trace."""

    path: str
    layout: str
    """Description of the format."""
    frames: tuple[TraceFrame, ...]
    notes: tuple[str, ...] = ()


def is_can_trace(lines: Sequence[str]) -> bool:
    """Whether 70 % of a file's first lines, from the first frame on, are frames of a CAN bus."""
    filled = [line.strip() for line in islice(lines, _SAMPLED) if line.strip()]
    head = csv_head(filled)
    readers = (*READERS.values(), general, *(() if head is None else (head.read,)))
    is_frame = [any(read(line) is not None for read in readers) for line in filled]
    first = is_frame.index(True) if True in is_frame else len(is_frame)
    found = [line for line, is_one in zip(filled, is_frame, strict=True) if is_one]
    is_enough = len(found) >= max(_FEWEST, _SHARE * len(filled[first:]))
    is_known = head is not None and head.is_known
    return is_enough and (is_known or any(map(is_marked, found)))


def trace_advice(path: Path) -> str:
    """What to do with a file that is a trace of CAN frames; empty for another one."""
    try:
        with open(path, "rb", opener=regular) as file:
            start = file.read(TRACED)
    except (OSError, ValueError):
        return ""
    return TRACE if is_trace(start) else ""


def is_trace(data: bytes) -> bool:
    """Whether the first bytes of a file are those of a trace of CAN frames."""
    return data.startswith(b"LOGG") or is_can_trace(data[:TRACED].decode("latin-1").splitlines())


def read_trace(path: str | Path) -> CanTrace:
    """Read the data frames of a trace; remote and error frames are counted in the notes.

    Raises FileError for a file that cannot be read, and for one without frames.
    """
    name = str(path)
    data = read_whole(Path(path), "trace of CAN frames", LARGEST)
    if not data:
        raise FileError(Fault("the file is empty", name))
    if len(data) > LARGEST:
        raise FileError(Fault(f"is larger than {LARGEST / 1e6:g} MB; split the trace", name))
    if data.startswith(b"LOGG"):
        return _read_blf(name, data)
    if b"\0" in data:
        raise FileError(Fault("is binary, no trace of CAN frames as text", name))
    return _read_text(name, data.decode("utf-8-sig", errors="replace").splitlines())


def _read_blf(name: str, data: bytes) -> CanTrace:
    import can

    frames: list[TraceFrame] = []
    others = declared = 0
    try:
        reader = can.BLFReader(io.BytesIO(data))
        declared = reader.object_count
        for number, message in enumerate(reader, start=1):
            if message.is_error_frame or message.is_remote_frame:
                others += 1
                continue
            content, bus = bytes(message.data), str(message.channel)
            identifier = message.arbitration_id
            frames.append(TraceFrame(number, message.timestamp, identifier, content, bus))
    except Exception as error:  # noqa: BLE001 - the library raises many kinds for damaged files
        raise FileError(Fault(f"is a damaged BLF file: {error}", name)) from None
    if not frames:
        raise FileError(Fault("has no CAN frames", name))
    notes = [f"remote and error frames, left out: {others}"] if others else []
    if len(frames) + others < declared:
        count = f"{len(frames) + others} of {declared}"
        notes.append(f"{count} objects are CAN frames: it has others too, or is cut off")
    return CanTrace(name, "BLF", tuple(frames), tuple(notes))


def _read_text(name: str, lines: Sequence[str]) -> CanTrace:
    layout, read, notes = _format_of(lines)
    frames: list[TraceFrame] = []
    others: list[int] = []
    without_data, texts = 0, []
    for number, line in enumerate(lines, start=1):
        if not line.strip() or line.lstrip()[0] in ";#":
            continue
        found = read(line.strip())
        if found is None:
            others.append(number)
        elif found.data is None:
            without_data += 1
        else:
            texts.append(found.identifier)
            frames.append(TraceFrame(number, found.time, 0, found.data, found.bus))
    known = len(frames) + without_data
    after = [number for number in others if frames and number > frames[0].line]
    # Any text has lines with numbers that look like a frame.
    if not frames or (layout == "text" and known < _SHARE * (known + len(after))):
        first = next((line.strip() for line in lines if line.strip()), "")
        message = "has no CAN frames as candump, TRC, ASC, BLF or CSV write them"
        raise FileError(Fault(f"{message}; it begins with {first[:_SHOWN]!r}", name))
    base = base_of(texts)
    if base == 10:
        notes.append("identifiers are decimal: hexadecimal ones would be beyond 11 bits")
    pairs = zip(frames, texts, strict=True)
    frames = [replace(frame, identifier=identifier_of(text, base)) for frame, text in pairs]
    if after:
        shown = lines[after[0] - 1].strip()[:_SHOWN]
        notes.append(f"lines that are no frames: {len(after)}, the first is {after[0]}, {shown!r}")
    if without_data:
        notes.append(f"remote and error frames, left out: {without_data}")
    return CanTrace(name, layout, tuple(_in_time(frames, layout, lines, notes)), tuple(notes))


def _format_of(lines: Sequence[str]) -> tuple[str, Callable[[str], TraceLine | None], list[str]]:
    """The format that most of the first lines have, its reader, and notes."""
    filled = [line.strip() for line in islice(lines, _SAMPLED) if line.strip()]
    counts = {name: sum(map(bool, map(read, filled))) for name, read in READERS.items()}
    best = max(counts, key=lambda name: counts[name])
    is_decimal = any(line.lower().startswith("base dec") for line in filled)
    if counts[best] and best == "ASC" and is_decimal:
        return best, partial(asc, base=10), ["identifiers and bytes are decimal (base dec)"]
    if counts[best]:
        return best, READERS[best], []
    head = csv_head(filled)
    if head is not None:
        return "CSV", head.read, list(head.notes)
    return "text", general, [f"the times have no unit that is known: {SECONDS}"]


def _in_time(
    frames: list[TraceFrame], layout: str, lines: Sequence[str], notes: list[str]
) -> Iterator[TraceFrame]:
    """Frames with times from one zero where the trace has those since the frame before."""
    times = [frame.time for frame in frames]
    relative = layout == "candump" and max(times) < 1e6 and any(b < a for a, b in pairwise(times))
    if layout == "ASC":
        relative = any("timestamps relative" in line for line in islice(lines, _SAMPLED))
    if relative:
        notes.append("times are those since the frame before (candump -td, relative); added up")
    if all(map(math.isnan, times)):
        notes.append("has no times")
    time = 0.0
    for frame in frames:
        time = time + frame.time if relative else frame.time
        yield replace(frame, time=time)
