"""The object dictionary of a simulated CANopen device: types, access, limits and present values."""

from __future__ import annotations

import configparser
import io
import struct
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

from winchkit.errors import Fault, FileError
from winchkit.extras import import_python_can
from winchkit.schema.eds.eds import read_eds_text

Key = tuple[int, int]
"""Index and sub-index."""
Value = int | bytes
"""An int for numbers, bytes for all other types."""
Guard = Callable[[int, int], "Abort | None"]
Watcher = Callable[[int, int], None]

_SET_POINTS = frozenset((0x6040, 0x6071, 0x607A, 0x60B0, 0x60B1, 0x60B2, 0x60C1, 0x60FF))
"""Objects that a master writes in every cycle."""
_FORMATS = {0x02: "b", 0x03: "h", 0x04: "i", 0x05: "B", 0x06: "H", 0x07: "I", 0x15: "q", 0x1B: "Q"}
_BOOLEAN = 0x01
"""Data type 0001h of CiA 301."""
_LIMITS = {0x6065, 0x6072, 0x6073, 0x607F, 0x6080, 0x60E0, 0x60E1}
"""Defaults without effect for limits whose default the EDS does not declare."""
_FIRST_OBJECT = 0x1000
"""Lowest index of objects; lower ones are data types."""
_SAVE = 0x65766173
"""Signature of 1010h, "save" in ASCII, little-endian (CiA 301)."""
_LOAD = 0x64616F6C
"""Signature of 1011h, "load" in ASCII, little-endian (CiA 301)."""


class Abort(IntEnum):
    """SDO abort codes of CiA 301."""

    TOGGLE = 0x05030000
    COMMAND = 0x05040001
    WRITE_ONLY = 0x06010001
    READ_ONLY = 0x06010002
    NO_OBJECT = 0x06020000
    NOT_MAPPABLE = 0x06040041
    PDO_LENGTH = 0x06040042
    INCOMPATIBLE = 0x06040043
    LENGTH = 0x06070010
    NO_SUB_INDEX = 0x06090011
    RANGE = 0x06090030
    GENERAL = 0x08000000
    SIGNATURE = 0x08000020
    STATE = 0x08000022


@dataclass(frozen=True)
class Entry:
    """One object as declared in the EDS."""

    name: str
    format: str
    """Letter of :mod:`struct`; empty for strings and domains."""
    access: str
    """ro, rw, wo, const, rwr or rww."""
    default: Value
    low: int | None = None
    high: int | None = None
    mappable: bool = False

    @property
    def size(self) -> int:
        """Size in bytes; 0 where it varies."""
        return struct.calcsize(self.format) if self.format else 0

    @property
    def readable(self) -> bool:
        """Whether it can be read."""
        return self.access != "wo"

    @property
    def writable(self) -> bool:
        """Whether it can be written."""
        return self.access not in ("ro", "const")

    def pack(self, value: Value) -> bytes:
        """Bytes on the bus, little-endian."""
        return value if isinstance(value, bytes) else struct.pack("<" + self.format, value)

    def unpack(self, data: bytes) -> Value | Abort:
        """Value of bytes on the bus, or the abort code for invalid ones."""
        if not self.format:
            return data
        if len(data) != self.size:
            return Abort.LENGTH
        return int(struct.unpack("<" + self.format, data)[0])


class ObjectDictionary:
    """Entries with their present values.

    ``guards`` may refuse a new number before it is stored, ``watchers`` are called afterwards; both
    are kept by index. ``computed`` has the functions of numbers that the device computes when they
    are read; it is complete before the first one is. Storing (1010h) and restoring (1011h) take
    effect at ``reset``.
    """

    def __init__(self, entries: Mapping[Key, Entry]) -> None:
        self._entries = dict(entries)
        self._indices = {index for index, _ in entries}
        self._values: dict[Key, Value] = {}
        self._layouts: dict[tuple[Key, ...], tuple[struct.Struct, list[Callable[[], Value]]]] = {}
        self._stored: dict[Key, Value] = {}
        self.guards: dict[int, Guard] = {0x1010: self._store, 0x1011: self._restore}
        self.watchers: dict[int, Watcher] = {}
        self.computed: dict[Key, Callable[[], int]] = {}
        self.changes = 0
        """Number of changes of stored values, but of the set-points of a cycle."""
        self.reset()

    def __contains__(self, key: Key) -> bool:
        return key in self._entries

    def __iter__(self) -> Iterator[Key]:
        return iter(self._entries)

    def entry(self, key: Key) -> Entry | Abort:
        """Look up a declaration, or the abort code for a missing index or sub-index."""
        found = self._entries.get(key)
        if found is not None:
            return found
        return Abort.NO_SUB_INDEX if key[0] in self._indices else Abort.NO_OBJECT

    def reset(self, indices: range = range(0x10000)) -> None:
        """Load the stored values, else the defaults, of a range of indices, as after power-on."""
        self.changes += 1
        for key, entry in self._entries.items():
            if key[0] in indices:
                self._values[key] = self._stored.get(key, entry.default)

    def number(self, index: int, sub: int = 0, default: int | None = None) -> int:
        """Present value of a numeric object, or the default without one; raises KeyError."""
        key = index, sub
        value = self._values.get(key, default)
        if value is None:
            raise KeyError(key)
        if key in self.computed and key in self._entries:
            return self.computed[key]()
        return value if isinstance(value, int) else int.from_bytes(value, "little")

    def put(self, index: int, sub: int, value: int) -> None:
        """Set a value by the device itself, without access rights, guards and watchers."""
        if (index, sub) in self._entries:
            self._values[index, sub] = value
            self.changes += 1

    def read(self, key: Key) -> bytes | Abort:
        """Read by a client."""
        entry = self.entry(key)
        if isinstance(entry, Abort):
            return entry
        return entry.pack(self._source(key)()) if entry.readable else Abort.WRITE_ONLY

    def _source(self, key: Key) -> Callable[[], Value]:
        """Function that returns the present value of a declared object."""
        return self.computed.get(key) or partial(self._values.__getitem__, key)

    def packed(self, keys: tuple[Key, ...]) -> bytes:
        """Values of several objects on the bus, without those that cannot be read."""
        layout = self._layouts.get(keys)
        if layout is None:
            declared = [(key, self._entries[key]) for key in keys if key in self._entries]
            kept = [(key, entry) for key, entry in declared if entry.readable and entry.format]
            pattern = struct.Struct("<" + "".join(entry.format for _, entry in kept))
            layout = self._layouts[keys] = pattern, [self._source(key) for key, _ in kept]
        pattern, sources = layout
        return pattern.pack(*[value() for value in sources])

    def receiver(self, keys: tuple[Key, ...], sizes: tuple[int, ...]) -> Callable[[bytes], None]:
        """Function that writes objects of given sizes from bytes; what does not fit is skipped."""
        pattern, kept = "<", []
        for key, size in zip(keys, sizes, strict=True):
            entry = self._entries.get(key)
            if entry is None or not entry.writable or entry.size not in (0, size):
                pattern += f"{size}x"
                continue
            pattern += entry.format or f"{size}s"
            kept.append((key, entry))
        layout, store = struct.Struct(pattern), self._store_checked

        def receive(data: bytes) -> None:
            for (key, entry), value in zip(kept, layout.unpack_from(data), strict=True):
                store(key, entry, value)

        return receive

    def refusal(self, key: Key) -> Abort | None:
        """Abort code for a write of any value by a client; None where writing is permitted."""
        entry = self.entry(key)
        if isinstance(entry, Abort):
            return entry
        return None if entry.writable else Abort.READ_ONLY

    def write(self, key: Key, data: bytes) -> Abort | None:
        """Write by a client; None when the value was accepted."""
        entry = self.entry(key)
        if isinstance(entry, Abort):
            return entry
        if not entry.writable:
            return Abort.READ_ONLY
        value = entry.unpack(data)
        return value if isinstance(value, Abort) else self._store_checked(key, entry, value)

    def _store_checked(self, key: Key, entry: Entry, value: Value) -> Abort | None:
        """Store a value of a client that the object may have."""
        if isinstance(value, bytes):
            self._values[key] = value
            self.changes += 1
            return None
        refused = self._check(key, entry, value)
        if refused is not None:
            return refused
        index, sub = key
        self._values[key] = value
        self.changes += index not in _SET_POINTS
        watcher = self.watchers.get(index)
        if watcher is not None:
            watcher(sub, value)
        return None

    def _check(self, key: Key, entry: Entry, value: int) -> Abort | None:
        if entry.low is not None and value < entry.low:
            return Abort.RANGE
        if entry.high is not None and value > entry.high:
            return Abort.RANGE
        guard = self.guards.get(key[0])
        return None if guard is None else guard(key[1], value)

    def _store(self, sub: int, signature: int) -> Abort | None:
        if signature != _SAVE:
            return Abort.SIGNATURE
        self._stored = {
            key: value for key, value in self._values.items() if self._entries[key].access == "rw"
        }
        return None

    def _restore(self, sub: int, signature: int) -> Abort | None:
        if signature != _LOAD:
            return Abort.SIGNATURE
        self._stored = {}
        return None


def read_eds(path: Path, node: int) -> dict[Key, Entry]:
    """Objects that an EDS or DCF file declares for a node id; FileError for any other file."""
    text = read_eds_text(path).text
    try:
        return dict(_declared(text, node))
    except (ValueError, KeyError, configparser.Error) as error:
        raise FileError(Fault(f"cannot be read as an EDS: {error}", str(path))) from error


@lru_cache(maxsize=32)
def _declared(text: str, node: int) -> dict[Key, Entry]:
    import_python_can()  # canopen imports it
    from canopen.objectdictionary import eds

    library: Any = eds
    declared = library.import_eds(io.StringIO(text), node)
    entries: dict[Key, Entry] = {}
    for thing in declared.values():
        members = [thing] if not hasattr(thing, "subindices") else thing.subindices.values()
        entries.update({(one.index, one.subindex): _entry(one) for one in members})
    return {key: entry for key, entry in entries.items() if key[0] >= _FIRST_OBJECT}


def _entry(variable: Any) -> Entry:
    letter = "B" if variable.data_type == _BOOLEAN else _FORMATS.get(variable.data_type, "")
    default = variable.default if variable.value is None else variable.value
    if letter:
        unlimited = default is None and variable.index in _LIMITS
        default = _most(letter) if unlimited else _fitting(int(default or 0), letter)
    elif not isinstance(default, bytes):
        default = str(default or "").encode()
    return Entry(
        variable.name,
        letter,
        variable.access_type,
        default,
        variable.min if letter else None,
        variable.max if letter else None,
        bool(variable.pdo_mappable),
    )


def _most(letter: str) -> int:
    bits = 8 * struct.calcsize(letter)
    return (1 << bits - letter.islower()) - 1


def _fitting(value: int, letter: str) -> int:
    """The signed number whose bits are written as an unsigned number, as in EDS files."""
    bits = 8 * struct.calcsize(letter)
    return value - (1 << bits) if letter.islower() and value >= 1 << (bits - 1) else value
