"""Traces of CAN frames (candump, ASC, TRC and others), which are no tables of numbers.

A frame of a trace has an identifier, a number of bytes n, and n bytes in hexadecimal digits;
``candump -L`` writes ``ID#BYTES``. A table of decimal numbers has this form by chance only.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import islice
from pathlib import Path

from winchkit.regular_file import regular

TRACED = 20_000
"""Bytes in which a trace is recognised."""
TRACE = (
    "is a trace of CAN frames, whose numbers are in the bytes of the frames: decode it first, by "
    "the DBC or EDS file of the device, to a table with a column for each signal (CSV, MDF, MAT) "
    "and import that"
)

_SAMPLED = 200
"""Lines by which a trace is recognised; its header has fewer."""
_FEWEST = 3
"""Frames that make a text a trace: one or two may look alike by chance."""
_SHARE = 0.7
"""Share of the lines from the first frame on that are frames; others are events and comments."""
_LOGGED = re.compile(r"\(\d+\.\d+\)\s+\S+\s+[0-9A-Fa-f]{3,8}#")
_ID = re.compile(r"(0x)?[0-9A-Fa-f]{1,8}[xh]?")
_BYTE = re.compile(r"[0-9A-Fa-f]{2}")
_MARKED = re.compile(r"0\d|[0-9]?[A-Fa-f][0-9A-Fa-f]?")
"""Bytes that no table of decimal numbers has: with a letter, or with a leading zero."""
_LONGEST = 64
"""Bytes of the longest frame, of CAN FD."""


def is_can_trace(lines: Sequence[str]) -> bool:
    """Whether lines of text are frames of a CAN bus.

    ``lines``: the first lines of a file. Returns: True where at least 70 % of the lines from the
    first frame on are frames.
    """
    filled = [line for line in islice(lines, _SAMPLED) if line.strip()]
    frames = [_frame_of(line) for line in filled]
    first = next((n for n, found in enumerate(frames) if found is not None), len(frames))
    found = [frame for frame in frames[first:] if frame is not None]
    is_marked = any(_MARKED.fullmatch(byte) for frame in found for byte in frame)
    return len(found) >= max(_FEWEST, _SHARE * len(frames[first:])) and is_marked


def trace_advice(path: Path) -> str:
    """What to do with a file that is a trace of CAN frames; empty for another one."""
    try:
        with open(path, "rb", opener=regular) as file:
            start = file.read(TRACED)
    except (OSError, ValueError):
        return ""
    return TRACE if is_can_trace(start.decode("latin-1").splitlines()) else ""


def _frame_of(line: str) -> list[str] | None:
    """Bytes of a frame; None for another line."""
    if _LOGGED.match(line.strip()):
        return ["0A"]
    words = re.split(r'[\s,;"]+', line.strip(' \t,;"'))
    for index, word in enumerate(words[1:], start=1):
        count = word.strip("[]")
        if not count.isdecimal() or not 0 < int(count) <= _LONGEST:
            continue
        data = words[index + 1 : index + 1 + int(count)]
        has_id = any(_ID.fullmatch(before) for before in words[:index])
        if has_id and len(data) == int(count) and all(_BYTE.fullmatch(byte) for byte in data):
            return data
    return None
