"""Traces of CAN frames: candump in its three forms, PCAN TRC, Vector ASC and BLF, and CSV.

``candump -L`` writes ``(TIME) BUS ID#BYTES``; ``candump`` on a terminal ``BUS ID [n] BYTES``, with
``-t`` behind a time in parentheses. Every other text trace has, in a line, an identifier, the
number n of bytes and n bytes; a CSV trace may name its columns instead.
"""

from __future__ import annotations

import base64
import binascii
import csv
import io
import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from itertools import islice, pairwise
from pathlib import Path

from winchkit.errors import Fault, FileError
from winchkit.regular_file import regular

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
_LENGTHS = (*range(9), 12, 16, 20, 24, 32, 48, 64)
"""Bytes of a frame of CAN FD by its data length code (ISO 11898-1)."""
_SHOWN = 60
"""Characters of a line that are shown in a note."""

_ID = r"[0-9A-Fa-f]{1,8}"
_LOGGED = re.compile(
    r"\((?P<time>\d+\.\d+)\)\s+(?P<bus>\S+)\s+(?P<id>[0-9A-Fa-f]{3,8})#"
    r"(?P<flags>#[0-9A-Fa-f])?(?P<data>R\w?|(?:[0-9A-Fa-f]{2}\.?)*)(?:\s+[RT])?$"
)
_DUMPED = re.compile(
    r"(?:\((?P<time>[\d.: -]+)\)\s+)?(?P<bus>[A-Za-z]\S*)\s+(?:[RT]X(?:\s+[-BE])*\s+)?"
    r"(?P<id>[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})\s+\[(?P<count>\d+)\]\s*(?P<data>.*)$"
)
_ASC = re.compile(
    rf"(?P<time>\d+[.,]\d+)\s+(?P<bus>\d+)\s+(?P<id>{_ID})x?\s+[RT]x(?:Rq)?\s+"
    r"(?P<kind>[dr])(?:\s+(?P<count>[0-9a-fA-F]+)(?P<data>(?:\s+[0-9A-Fa-f]{1,3})*))?",
    re.IGNORECASE,
)
_ASC_FD = re.compile(
    rf"(?P<time>\d+[.,]\d+)\s+CANFD\s+(?P<bus>\d+)\s+(?P<kind>[RT]x)\s+(?P<id>{_ID})x?\s+"
    r"(?:\S+\s+)?[01]\s+[01]\s+(?P<count>[0-9a-fA-F])\s+\d+(?P<data>(?:\s+[0-9A-Fa-f]{1,3})*)"
)
_TRC = re.compile(
    r"\d+\)?\s+(?P<time>\d+\.?\d*)\s+(?:(?P<kind>DT|FD|FB|FE|BI|RR)\s+)?(?:(?P<bus>\d)\s+)?"
    r"(?:[RT]x\s+)?(?P<id>[0-9A-Fa-f]{4}|[0-9A-Fa-f]{8})\s+(?:[RT]x\s+)?(?:-\s+)?(?P<count>\d+)"
    r"\s*(?P<data>RTR|(?:[0-9A-Fa-f]{2}\s*)*)$"
)
_WORD_ID = re.compile(rf"(0x)?{_ID}[xh]?")
_BYTE = re.compile(r"[0-9A-Fa-f]{2}")
_MARKED = re.compile(r"0\d|[0-9]?[A-Fa-f][0-9A-Fa-f]?")
"""Bytes that no table of decimal numbers has: with a letter, or with a leading zero."""
_FRACTION = re.compile(r"\d+[.,]\d+")

_TIME, _IDENTIFIER, _DATA, _LENGTH, _BUS = "time", "identifier", "data", "length", "bus"
_COLUMNS = {
    _TIME: r"time ?stamp|(abs(olute)? |rel(ative)? )?time( offset)?|t",
    _IDENTIFIER: r"(can ?|arbitration ?|message ?|msg ?|cob ?)?(id|identifier)",
    _DATA: r"(data|payload)( ?bytes?)?",
    _LENGTH: r"(data ?)?(len|length)|dlc",
    _BUS: r"bus|channel|interface",
    "remote": r"(is )?(remote|rtr)( frame)?",
    "error": r"(is )?error( frame)?",
}
"""Names of the columns of a CSV trace, in lower case, without units and with spaces for ``_``."""
_BYTE_COLUMN = re.compile(r"(?:d|b|data|byte|data byte)? ?(\d)")
_UNITS = {"s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
_UNIT = re.compile(r"[\[(_ ](s|sec|seconds|ms|us|µs|ns)[\])]?$")


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
class Trace:
    """Content of a trace."""

    path: str
    layout: str
    """Description of the format."""
    frames: tuple[TraceFrame, ...]
    notes: tuple[str, ...] = ()


def is_can_trace(lines: Sequence[str]) -> bool:
    """Whether lines of text are frames of a CAN bus.

    ``lines``: the first lines of a file. Returns: True where at least 70 % of the lines from the
    first frame on are frames.
    """
    filled = [line.strip() for line in islice(lines, _SAMPLED) if line.strip()]
    head = _csv_head(filled)
    readers = (*_READERS.values(), _general, *(() if head is None else (head.read,)))
    is_frame = [any(read(line) is not None for read in readers) for line in filled]
    first = is_frame.index(True) if True in is_frame else len(is_frame)
    found = [line for line, is_one in zip(filled, is_frame, strict=True) if is_one]
    is_enough = len(found) >= max(_FEWEST, _SHARE * len(filled[first:]))
    is_known = head is not None and head.is_known
    return is_enough and (is_known or any(map(_is_marked, found)))


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


def read_trace(path: str | Path) -> Trace:
    """Read the data frames of a trace.

    Returns: frames in the order of the file, with times in s. Remote and error frames are counted
    in the notes. Raises FileError for a file that cannot be read, and for one without frames.
    """
    name = str(path)
    try:
        with open(path, "rb", opener=regular) as file:
            data = file.read(LARGEST + 1)
    except FileNotFoundError:
        raise FileError(Fault("there is no such file", name)) from None
    except (OSError, ValueError) as error:
        raise FileError(Fault(f"cannot be read: {error}", name)) from None
    if not data:
        raise FileError(Fault("the file is empty", name))
    if len(data) > LARGEST:
        raise FileError(Fault(f"is larger than {LARGEST / 1e6:g} MB; split the trace", name))
    if data.startswith(b"LOGG"):
        return _read_blf(name, data)
    if b"\0" in data:
        raise FileError(Fault("is binary, no trace of CAN frames as text", name))
    return _read_text(name, data.decode("utf-8-sig", errors="replace").splitlines())


def _read_blf(name: str, data: bytes) -> Trace:
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
    return Trace(name, "BLF", tuple(frames), tuple(notes))


@dataclass(frozen=True)
class _Line:
    """A line as its format has it; ``data`` is None for a remote or error frame."""

    time: float
    identifier: str
    data: bytes | None
    bus: str = ""


def _read_text(name: str, lines: Sequence[str]) -> Trace:
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
    if not frames:
        first = next((line.strip() for line in lines if line.strip()), "")
        message = "has no CAN frames as candump, TRC, ASC, BLF or CSV write them"
        raise FileError(Fault(f"{message}; it begins with {first[:_SHOWN]!r}", name))
    base = _base_of(texts)
    if base == 10:
        notes.append("identifiers are decimal: hexadecimal ones would be beyond 11 bits")
    pairs = zip(frames, texts, strict=True)
    frames = [replace(frame, identifier=_identifier(text, base)) for frame, text in pairs]
    after = [number for number in others if number > frames[0].line]
    if after:
        shown = lines[after[0] - 1].strip()[:_SHOWN]
        notes.append(f"lines that are no frames: {len(after)}, the first is {after[0]}, {shown!r}")
    if without_data:
        notes.append(f"remote and error frames, left out: {without_data}")
    return Trace(name, layout, tuple(_in_time(frames, layout, lines, notes)), tuple(notes))


def _format_of(lines: Sequence[str]) -> tuple[str, Callable[[str], _Line | None], list[str]]:
    """The format that most of the first lines have, its reader, and notes."""
    filled = [line.strip() for line in islice(lines, _SAMPLED) if line.strip()]
    counts = {name: sum(map(bool, map(read, filled))) for name, read in _READERS.items()}
    best = max(counts, key=lambda name: counts[name])
    is_decimal = any(line.lower().startswith("base dec") for line in filled)
    if counts[best] and best == "ASC" and is_decimal:
        return best, partial(_asc, base=10), ["identifiers and bytes are decimal (base dec)"]
    if counts[best]:
        return best, _READERS[best], []
    head = _csv_head(filled)
    if head is not None:
        return "CSV", head.read, list(head.notes)
    return "text", _general, []


def _is_marked(line: str) -> bool:
    """Whether a frame has an identifier or bytes that are no decimal numbers for certain."""
    return "#" in line or any(_MARKED.fullmatch(word) for word in _words(line)[1:])


def _logged(line: str) -> _Line | None:
    found = _LOGGED.match(line)
    if found is None:
        return None
    is_data = not found["data"].startswith("R")
    data = bytes.fromhex(found["data"].replace(".", "")) if is_data else None
    return _Line(float(found["time"]), found["id"], data, found["bus"])


def _dumped(line: str) -> _Line | None:
    found = _DUMPED.match(line)
    if found is None:
        return None
    time = _dump_time(found["time"] or "")
    words = found["data"].split()
    data = _bytes(words[: int(found["count"])], int(found["count"]))
    is_other = "remote request" in found["data"] or "ERRORFRAME" in found["data"]
    if data is None and not is_other:
        return None
    return _Line(time, found["id"], None if is_other else data, found["bus"])


def _dump_time(text: str) -> float:
    """Time of ``candump -t``: seconds, or with ``-tA`` a date; NaN for none."""
    try:
        return float(text) if text else math.nan
    except ValueError:
        pass
    try:
        return datetime.fromisoformat(text.strip()).replace(tzinfo=UTC).timestamp()
    except ValueError:
        return math.nan


def _asc(line: str, base: int = 16) -> _Line | None:
    found = _ASC.match(line) or _ASC_FD.match(line)
    if found is None:
        return None
    data = None
    if found["kind"].lower() != "r":
        count = int(found["count"] or "0", 16)
        count = _LENGTHS[count] if found.re is _ASC_FD else count
        words = (found["data"] or "").split()[:count]
        data = _bytes([f"{int(word, base):02X}" for word in words], count)
        if data is None:
            return None
    identifier = f"{int(found['id'], base):X}"
    return _Line(_seconds(found["time"]), identifier, data, found["bus"])


def _trc(line: str) -> _Line | None:
    found = _TRC.match(line)
    if found is None:
        return None
    is_remote = found["data"] == "RTR" or found["kind"] == "RR"
    words, count = found["data"].split(), int(found["count"])
    # A data length code, or the number of bytes ($COLUMNS with L or l).
    count = _LENGTHS[count] if len(words) > count and count < len(_LENGTHS) else count
    data = None if is_remote else _bytes(words, count)
    if data is None and not is_remote:
        return None
    return _Line(1e-3 * float(found["time"]), found["id"], data, found["bus"] or "")


_READERS: dict[str, Callable[[str], _Line | None]] = {
    "candump -L": _logged,
    "candump": _dumped,
    "ASC": _asc,
    "TRC": _trc,
}


def _words(line: str) -> list[str]:
    return re.split(r'[\s,;"]+', line.strip(' \t,;"'))


def _general(line: str) -> _Line | None:
    """A line of identifier, number of bytes and bytes; its time is a number with a fraction."""
    words = _words(line)
    for index, word in enumerate(words[1:], start=1):
        count = word.strip("[]")
        if not count.isdecimal() or not 0 < int(count) <= _LENGTHS[-1]:
            continue
        before = [one for one in words[:index] if _WORD_ID.fullmatch(one)]
        data = _bytes(words[index + 1 : index + 1 + int(count)], int(count))
        if before and data is not None:
            head = line[: line.find(before[-1])] or line
            time = _FRACTION.search(head)
            return _Line(_seconds(time[0]) if time else math.nan, before[-1], data)
    return None


def _bytes(words: Sequence[str], count: int) -> bytes | None:
    if len(words) != count or count > _LENGTHS[-1] or not all(map(_BYTE.fullmatch, words)):
        return None
    return bytes.fromhex("".join(words))


def _seconds(text: str) -> float:
    return float(text.replace(",", "."))


def _base_of(texts: Sequence[str]) -> int:
    """16, or 10 where all identifiers are decimal and some are beyond 11 bits as hexadecimal."""
    if not all((text.isdecimal() and not text.startswith("0")) or text == "0" for text in texts):
        return 16
    is_beyond = any(int(text, 16) > 0x7FF for text in texts)
    return 10 if is_beyond and all(int(text) <= 0x7FF for text in texts) else 16


def _identifier(text: str, base: int) -> int:
    return int(text.lower().removeprefix("0x").rstrip("xh"), base)


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


@dataclass(frozen=True)
class _CsvHead:
    """Columns of a CSV trace."""

    delimiter: str
    places: dict[str, int]
    bytes_from: int | None
    """First of the columns of single bytes."""
    scale: float
    """s of one unit of time; NaN where it is not known."""
    is_base64: bool
    notes: tuple[str, ...]
    is_known: bool
    """Whether the head is that of a program for CAN."""

    def read(self, line: str) -> _Line | None:
        """A row; None for another line."""
        cells = [cell.strip() for cell in next(csv.reader([line], delimiter=self.delimiter), [])]
        if len(cells) <= max(self.places.values()):
            return None
        identifier = cells[self.places[_IDENTIFIER]]
        data = self._data(cells)
        if not _WORD_ID.fullmatch(identifier) or data is None:
            return None
        is_other = any(
            cells[self.places[key]].lower() in ("1", "true", "yes")
            for key in ("remote", "error")
            if key in self.places
        )
        bus = cells[self.places[_BUS]] if _BUS in self.places else ""
        return _Line(self._time(cells), identifier, None if is_other else data, bus)

    def _time(self, cells: Sequence[str]) -> float:
        text = cells[self.places[_TIME]] if _TIME in self.places else ""
        try:
            value = _seconds(text)
        except ValueError:
            return math.nan
        if math.isnan(self.scale):
            return value if _FRACTION.fullmatch(text) else math.nan
        return self.scale * value

    def _data(self, cells: Sequence[str]) -> bytes | None:
        if self.bytes_from is not None:
            words = [word for word in cells[self.bytes_from :] if word]
            length = cells[self.places[_LENGTH]] if _LENGTH in self.places else str(len(words))
            count = int(length) if length.isdecimal() else len(words)
            return _bytes([word.removeprefix("0x").zfill(2) for word in words[:count]], count)
        text = cells[self.places[_DATA]]
        if self.is_base64:
            try:
                return base64.b64decode(text, validate=True)
            except binascii.Error:
                return None
        bare = re.sub(r"0x|[\s_:-]", "", text)
        return bytes.fromhex(bare) if re.fullmatch(r"([0-9A-Fa-f]{2})*", bare) else None


def _csv_head(lines: Sequence[str]) -> _CsvHead | None:
    """Columns of a CSV trace by their names; None for another file."""
    first = next((line for line in lines if line.strip() and line.strip()[0] not in ";#"), "")
    for delimiter in ",;\t":
        cells = [cell.strip() for cell in next(csv.reader([first], delimiter=delimiter), [])]
        names = [re.sub(r"[\[(].*$", "", cell.lower()).replace("_", " ").strip() for cell in cells]
        places: dict[str, int] = {}
        for key, pattern in _COLUMNS.items():
            found = [n for n, name in enumerate(names) if re.fullmatch(pattern, _without(name))]
            if found:
                places[key] = found[0]
        singles = [n for n, name in enumerate(names) if _BYTE_COLUMN.fullmatch(name)]
        if _IDENTIFIER not in places or not (_DATA in places or singles):
            continue
        if _DATA not in places:
            places[_DATA] = singles[0]
        is_base64, is_savvy = cells == _PYTHON_CAN, first.startswith(_SAVVYCAN)
        scale, notes = (
            (1.0, ())
            if is_base64 or _TIME not in places
            else _time_scale(cells[places[_TIME]], is_savvy=is_savvy)
        )
        bytes_from, is_known = singles[0] if singles else None, is_base64 or is_savvy
        return _CsvHead(delimiter, places, bytes_from, scale, is_base64, notes, is_known)
    return None


_PYTHON_CAN = ["timestamp", "arbitration_id", "extended", "remote", "error", "dlc", "data"]
"""Head of python-can's CSV, whose bytes are in base 64."""
_SAVVYCAN = "Time Stamp,ID,Extended,"
"""Head of SavvyCAN's CSV, whose times are in microseconds."""


def _without(name: str) -> str:
    return re.sub(r" (s|sec|seconds|ms|us|µs|ns|hex)$", "", name)


def _time_scale(cell: str, *, is_savvy: bool) -> tuple[float, tuple[str, ...]]:
    if found := _UNIT.search(cell.lower()):
        return _UNITS[found[1]], ()
    if is_savvy:
        return 1e-6, ("times are in microseconds, as SavvyCAN writes them",)
    note = "numbers with a fraction are taken as seconds, others are no times"
    return math.nan, (f"'{cell}' has no unit: {note}",)
