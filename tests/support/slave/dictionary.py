"""The object dictionary of a slave, read from any EDS or DCF of CiA 306."""

from __future__ import annotations

import configparser
import re
import struct
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

SIGNED = {0x02: 1, 0x03: 2, 0x04: 4, 0x10: 3, 0x12: 5, 0x13: 6, 0x14: 7, 0x15: 8}
UNSIGNED = {0x01: 1, 0x05: 1, 0x06: 2, 0x07: 4, 0x16: 3, 0x18: 5, 0x19: 6, 0x1A: 7, 0x1B: 8}
REAL = {0x08: 4, 0x11: 8}
_TEXT = (0x09, 0x0B)
_HEAD = re.compile(r"^([0-9A-Fa-f]{4})(?:sub([0-9A-Fa-f]{1,2}))?$", re.IGNORECASE)
_ARRAY = 0x08
_COMPACT = _ARRAY, 0x09


class Abort(Exception):
    """An SDO abort with its code of CiA 301, table 22."""

    def __init__(self, code: int) -> None:
        super().__init__(f"{code:08X}h")
        self.code = code


@dataclass
class Entry:
    """One sub-object: its declaration and its value as bytes."""

    kind: int
    access: str
    mappable: bool
    value: bytes
    low: int | None = None
    high: int | None = None
    _decoded: tuple[bytes, int] = field(default=(b"", 0), init=False, repr=False, compare=False)
    """Value and number: the slave reads its objects in every step."""

    @property
    def size(self) -> int | None:
        """Bytes of a number; None for strings and domains."""
        return SIGNED.get(self.kind) or UNSIGNED.get(self.kind) or REAL.get(self.kind)

    @property
    def number(self) -> int:
        """The value of a whole number."""
        value, number = self._decoded
        if value is not self.value:
            number = int.from_bytes(self.value, "little", signed=self.kind in SIGNED)
            self._decoded = (self.value, number)
        return number

    @number.setter
    def number(self, value: int) -> None:
        size = self.size or 4
        self.value = (value & (1 << 8 * size) - 1).to_bytes(size, "little")


class Dictionary:
    """Objects by index and sub-index."""

    def __init__(
        self, entries: dict[tuple[int, int], Entry], arrays: frozenset[int] = frozenset()
    ) -> None:
        self.entries, self._arrays = entries, arrays
        self._indices = {index for index, _ in entries}
        self._start = {key: item.value for key, item in entries.items()}

    def restart(self, first: int = 0, last: int = 0xFFFF) -> None:
        """Give the objects from ``first`` to ``last`` the values of power-on."""
        for key, value in self._start.items():
            if first <= key[0] <= last:
                self.entries[key].value = value

    def copy(self) -> Dictionary:
        """The same objects with values of their own."""
        return Dictionary({key: replace(item) for key, item in self.entries.items()}, self._arrays)

    def has(self, index: int, sub: int = 0) -> bool:
        """Whether the slave has this object."""
        return (index, sub) in self.entries

    def get(self, index: int, sub: int = 0, default: int = 0) -> int:
        """The value of a number; ``default`` where the slave lacks the object."""
        entry = self.entries.get((index, sub))
        return default if entry is None else entry.number

    def set(self, index: int, sub: int, value: int) -> None:
        """Set a number, whatever its access; nothing where the slave lacks it."""
        entry = self.entries.get((index, sub))
        if entry is not None:
            entry.number = value

    def declare(self, index: int, sub: int, kind: int, value: int, access: str = "rw") -> None:
        """Add an object that the file lacks, or replace it."""
        entry = Entry(kind, access, True, b"")
        entry.number = value
        self.entries[index, sub] = entry
        self._start[index, sub] = entry.value
        self._indices.add(index)

    def remove(self, index: int) -> None:
        """Take an object away with all its sub-objects."""
        for key in [key for key in self.entries if key[0] == index]:
            del self.entries[key], self._start[key]
        self._indices.discard(index)

    def entry(self, index: int, sub: int) -> Entry:
        """A sub-object; raises Abort as the standard names what is missing."""
        found = self.entries.get((index, sub))
        if found is None:
            raise Abort(0x06090011 if index in self._indices else 0x06020000)
        return found

    def upload(self, index: int, sub: int) -> bytes:
        """Bytes for an SDO upload; raises Abort."""
        entry = self.entry(index, sub)
        if entry.access == "wo":
            raise Abort(0x06010001)
        if index in self._arrays and sub > self.get(index):
            raise Abort(0x08000024)  # an element above the present count holds no data
        return entry.value

    def check_download(self, index: int, sub: int, data: bytes) -> None:
        """Raise Abort where this may not be written."""
        entry = self.entry(index, sub)
        if entry.access in ("ro", "const"):
            raise Abort(0x06010002)
        if entry.size is None:
            return
        if len(data) != entry.size:
            raise Abort(0x06070012 if len(data) > entry.size else 0x06070013)
        if entry.kind in REAL:
            return
        value = int.from_bytes(data, "little", signed=entry.kind in SIGNED)
        if entry.high is not None and value > entry.high:
            raise Abort(0x06090031)
        if entry.low is not None and value < entry.low:
            raise Abort(0x06090032)


def read(path: Path, node: int) -> Dictionary:
    """Read an EDS or DCF; duplicate sections, unused list numbers and odd text are let pass."""
    return _parsed(path, node).copy()


@cache
def _parsed(path: Path, node: int) -> Dictionary:
    parser = configparser.RawConfigParser(
        strict=False,
        delimiters=("=",),
        comment_prefixes=(";",),
        inline_comment_prefixes=(";",),
        allow_no_value=True,
        empty_lines_in_values=False,
    )
    text = path.read_bytes().decode("latin-1")
    start = text.find("[")
    parser.read_string(text[start:])
    entries: dict[tuple[int, int], Entry] = {}
    arrays = set()
    for name in parser.sections():
        match = _HEAD.match(name.strip())
        if match is None:
            continue
        section = {key: (value or "").strip() for key, value in parser[name].items()}
        index, sub = int(match[1], 16), match[2]
        if sub is not None:
            entries[index, int(sub, 16)] = _entry(section, node)
        elif _number(section.get("objecttype", ""), node) not in _COMPACT:
            entries.setdefault((index, 0), _entry(section, node))
        else:
            _add_compact(entries, index, section, node)
        if sub is None and _number(section.get("objecttype", ""), node) == _ARRAY:
            arrays.add(index)
    return Dictionary(entries, frozenset(arrays))


def _add_compact(
    entries: dict[tuple[int, int], Entry], index: int, section: dict[str, str], node: int
) -> None:
    """Sub-objects of an array that is declared as a whole (CiA 306, CompactSubObj)."""
    count = _number(section.get("compactsubobj", ""), node) or 0
    if not count:
        return
    entries.setdefault((index, 0), Entry(0x05, "ro", False, bytes((count,))))
    for sub in range(1, count + 1):
        entries.setdefault((index, sub), _entry(section, node))


def _entry(section: dict[str, str], node: int) -> Entry:
    kind = _number(section.get("datatype", ""), node) or 0x0F
    entry = Entry(
        kind,
        section.get("accesstype", "ro").lower(),
        section.get("pdomapping", "0").strip() not in ("", "0", "0x0"),
        b"",
        _limit(section.get("lowlimit", ""), kind, node),
        _limit(section.get("highlimit", ""), kind, node),
    )
    given = section.get("defaultvalue") or section.get("parametervalue") or ""
    entry.value = _value(given, entry, node)
    if entry.low is not None and entry.high is not None and entry.low >= entry.high:
        entry.low = entry.high = None
    return entry


def _limit(text: str, kind: int, node: int) -> int | None:
    number = _number(text, node)
    if number is None or kind not in SIGNED:
        return number
    size = 8 * SIGNED[kind]
    return number - (1 << size) if number >= 1 << (size - 1) else number


def _value(text: str, entry: Entry, node: int) -> bytes:
    if entry.size is None:
        return text.encode("latin-1") if entry.kind in _TEXT else b""
    if entry.kind in REAL:
        try:
            return struct.pack("<f" if entry.size == 4 else "<d", float(text or 0))
        except ValueError:
            return bytes(entry.size)
    number = _number(text, node) or 0
    return (number & (1 << 8 * entry.size) - 1).to_bytes(entry.size, "little")


def _number(text: str, node: int) -> int | None:
    """A whole number as EDS files write it, ``$NODEID + 0x180`` included."""
    total, found = 0, False
    for part in re.split(r"\+", text.replace(" ", "")):
        if part.upper() == "$NODEID":
            total, found = total + node, True
            continue
        try:
            total, found = total + _whole(part), True
        except ValueError:
            continue
    return total if found else None


def _whole(text: str) -> int:
    digits = text.lstrip("+-")
    if len(digits) > 1 and digits.startswith("0") and digits[1] not in "xXbBoO":
        return int(text, 8) if set(digits) <= set("01234567") else int(text)
    return int(text, 0)
