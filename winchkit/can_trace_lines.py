"""Lines of traces of CAN frames, by the program that wrote them, and columns of CSV traces.

``candump -L`` writes ``(TIME) BUS ID#BYTES``; ``candump`` on a terminal ``BUS ID [n] BYTES``, with
``-t`` behind a time in parentheses. Every other text trace has, in a line, an identifier, the
number n of bytes and n bytes; a CSV trace may name its columns instead.
"""

from __future__ import annotations

import base64
import binascii
import csv
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import product

_LENGTHS = (*range(9), 12, 16, 20, 24, 32, 48, 64)
"""Bytes of a frame of CAN FD by its data length code (ISO 11898-1)."""

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
_CLOCK = re.compile(r"(\d+):(\d\d):(\d\d[.,]\d+)")

_TIME, _IDENTIFIER, _DATA, _LENGTH, _BUS = "time", "identifier", "data", "length", "bus"
_COLUMNS = {
    _TIME: r"time ?stamp|(abs(olute)? |rel(ative)? )?time( offset)?|t|zeit(stempel)?|temps|tiempo",
    _IDENTIFIER: r"(can ?|arbitration ?|message ?|msg ?|cob ?)?(id|identifier)",
    _DATA: r"(data|payload|daten|données|datos)( ?bytes?)?",
    _LENGTH: r"(data ?)?(len|length)|dlc|länge|longueur|longitud",
    _BUS: r"bus|channel|interface|kanal|canal",
    "remote": r"(is )?(remote|rtr)( frame)?|flags",
    "error": r"(is )?error( frame)?",
}
"""Names of the columns of a CSV trace, in lower case, without units and with spaces for ``_``."""
SECONDS = "numbers with a fraction are taken as seconds, others are no times"
_BYTE_COLUMN = re.compile(r"(?:d|b|data|byte|data byte)? ?(\d)")
_UNITS = {"s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
_UNIT = re.compile(r"[\[(_ ](s|sec|seconds|ms|us|µs|ns)[\])]?$")
_BRACKETED = re.compile(r"[\[(](s|sec|seconds|ms|us|µs|ns)[\])]$")


@dataclass(frozen=True)
class TraceLine:
    """A line as its format has it; ``data`` is None for a remote or error frame."""

    time: float
    identifier: str
    data: bytes | None
    bus: str = ""


def is_marked(line: str) -> bool:
    """Whether a frame has an identifier or bytes that are no decimal numbers for certain."""
    return "#" in line or any(_MARKED.fullmatch(word) for word in _words(line)[1:])


def _logged(line: str) -> TraceLine | None:
    found = _LOGGED.match(line)
    if found is None:
        return None
    is_data = not found["data"].startswith("R")
    data = bytes.fromhex(found["data"].replace(".", "")) if is_data else None
    return TraceLine(float(found["time"]), found["id"], data, found["bus"])


def _dumped(line: str) -> TraceLine | None:
    found = _DUMPED.match(line)
    if found is None:
        return None
    time = _dump_time(found["time"] or "")
    words = found["data"].split()
    data = _bytes(words[: int(found["count"])], int(found["count"]))
    is_other = "remote request" in found["data"] or "ERRORFRAME" in found["data"]
    if data is None and not is_other:
        return None
    return TraceLine(time, found["id"], None if is_other else data, found["bus"])


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


def asc(line: str, base: int = 16) -> TraceLine | None:
    """A line of Vector; with ``base dec`` its identifier and bytes are decimal."""
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
    return TraceLine(_seconds(found["time"]), identifier, data, found["bus"])


def _trc(line: str) -> TraceLine | None:
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
    return TraceLine(1e-3 * float(found["time"]), found["id"], data, found["bus"] or "")


READERS: dict[str, Callable[[str], TraceLine | None]] = {
    "candump -L": _logged,
    "candump": _dumped,
    "ASC": asc,
    "TRC": _trc,
}


def _words(line: str) -> list[str]:
    return re.split(r'[\s,;"]+', line.strip(' \t,;"'))


def general(line: str) -> TraceLine | None:
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
            return TraceLine(_seconds(time[0]) if time else math.nan, before[-1], data)
    return None


def _bytes(words: Sequence[str], count: int) -> bytes | None:
    if len(words) != count or count > _LENGTHS[-1] or not all(map(_BYTE.fullmatch, words)):
        return None
    return bytes.fromhex("".join(words))


def _seconds(text: str) -> float:
    return float(text.replace(",", "."))


def base_of(texts: Sequence[str]) -> int:
    """16, or 10 where all identifiers are decimal and some are beyond 11 bits as hexadecimal."""
    if not all((text.isdecimal() and not text.startswith("0")) or text == "0" for text in texts):
        return 16
    is_beyond = any(int(text, 16) > 0x7FF for text in texts)
    return 10 if is_beyond and all(int(text) <= 0x7FF for text in texts) else 16


def identifier_of(text: str, base: int) -> int:
    """Number of an identifier, ``0x181``, ``181h`` or ``18DAF110x`` of 29 bits."""
    return int(text.lower().removeprefix("0x").rstrip("xh"), base)


@dataclass(frozen=True)
class CsvHead:
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

    def read(self, line: str) -> TraceLine | None:
        """A row; None for another line."""
        cells = [cell.strip() for cell in next(csv.reader([line], delimiter=self.delimiter), [])]
        if len(cells) <= max(self.places.values()):
            return None
        identifier = cells[self.places[_IDENTIFIER]]
        is_other = any(
            cells[self.places[key]].lower() in ("1", "true", "yes", "rtr")
            for key in ("remote", "error")
            if key in self.places
        )
        data = None if is_other else self._data(cells)
        if not _WORD_ID.fullmatch(identifier) or (data is None and not is_other):
            return None
        bus = cells[self.places[_BUS]] if _BUS in self.places else ""
        return TraceLine(self._time(cells), identifier, data, bus)

    def _time(self, cells: Sequence[str]) -> float:
        text = cells[self.places[_TIME]] if _TIME in self.places else ""
        if clock := _CLOCK.fullmatch(text):
            return 3600 * int(clock[1]) + 60 * int(clock[2]) + _seconds(clock[3])
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


def csv_head(lines: Sequence[str]) -> CsvHead | None:
    """Columns of a CSV trace by their names; None for another file."""
    filled = [line for line in lines if line.strip() and line.strip()[0] not in ";#"]
    for first, delimiter in product(filled[:_TITLES], ",;\t"):
        cells = [cell.strip() for cell in next(csv.reader([first], delimiter=delimiter), [])]
        names = [re.sub(r"[\[(].*$", "", cell.lower()).replace("_", " ").strip() for cell in cells]
        places: dict[str, int] = {}
        for key, pattern in _COLUMNS.items():
            found = [n for n, name in enumerate(names) if re.fullmatch(pattern, _without(name))]
            if found:
                places[key] = found[0]
        if timed := [n for n, cell in enumerate(cells) if _BRACKETED.search(cell.lower())]:
            places.setdefault(_TIME, timed[0])
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
        return CsvHead(delimiter, places, bytes_from, scale, is_base64, notes, is_known)
    return None


_PYTHON_CAN = ["timestamp", "arbitration_id", "extended", "remote", "error", "dlc", "data"]
"""Head of python-can's CSV, whose bytes are in base 64."""
_TITLES = 12
"""Lines above the head of a CSV trace: program, date, bit rate."""
_SAVVYCAN = "Time Stamp,ID,Extended,"
"""Head of SavvyCAN's CSV, whose times are in microseconds."""


def _without(name: str) -> str:
    return re.sub(r" (s|sec|seconds|ms|us|µs|ns|hex)$", "", name)


def _time_scale(cell: str, *, is_savvy: bool) -> tuple[float, tuple[str, ...]]:
    if found := _UNIT.search(cell.lower()):
        return _UNITS[found[1]], ()
    if is_savvy:
        return 1e-6, ("times are in microseconds, as SavvyCAN writes them",)
    return math.nan, (f"'{cell}' has no unit: {SECONDS}",)
