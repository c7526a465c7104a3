"""The PDOs of a simulated drive: mapping by the rules of CiA 301, SYNC, events, timers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

from winchkit.sim.drive.object_dictionary import Abort, Entry, Key, ObjectDictionary

_INVALID = 1 << 31
"""Bit 31 of sub-index 1 (CiA 301): the PDO does not exist."""
_NO_RTR = 1 << 30
"""Bit 30 of sub-index 1: no remote request."""
_IDENTIFIER = 0x7FF
"""Bits 0 to 10 of sub-index 1: CAN-ID of a base frame."""
_LONGEST = 64
"""Bits of eight data bytes."""
_PDOS = range(0x200)
_RESERVED_TYPES = range(241, 252)
_RTR_TYPES = (252, 253)
_LAST_SYNCHRONOUS = 240
"""Transmission types 0 to 240 are synchronous (CiA 301)."""
_LAST_DUMMY = 0x1F
"""Data types 0001h to 001Fh may be mapped as dummies (CiA 301)."""
_TICK_INHIBIT = 1e-4
"""s: unit of the inhibit time (sub-index 3)."""
_TICK_EVENT = 1e-3
"""s: unit of the event timer (sub-index 5)."""


@dataclass
class _Pdo:
    """One valid PDO with its resolved mapping."""

    number: int
    """Number, from 0."""
    identifier: int
    kind: int
    """Transmission type."""
    keys: tuple[Key, ...]
    sizes: tuple[int, ...]
    receive: Callable[[bytes], None]
    """Writes the objects of an RPDO."""
    inhibit: float = 0.0
    event: float = 0.0
    waiting: bytes | None = None
    """Data of an RPDO that take effect at the next SYNC."""
    syncs: int = 0
    sent: bytes | None = None
    sent_at: float = -inf

    def __post_init__(self) -> None:
        self.synchronous = self.kind <= _LAST_SYNCHRONOUS
        self.length = sum(self.sizes)


class Pdos:
    """Serves the records 1400h–1BFFh of an object dictionary.

    ``send`` takes an identifier and data, ``short`` is called for an RPDO with too few bytes, and
    ``sample`` before objects are packed, to update their values.
    """

    def __init__(
        self,
        objects: ObjectDictionary,
        send: Callable[[int, bytes], None],
        sample: Callable[[], None],
        short: Callable[[], None],
    ) -> None:
        self._objects = objects
        self._send, self._sample, self._short = send, sample, short
        self._receive: dict[int, _Pdo] = {}
        self._synchronous: list[_Pdo] = []
        self._event_driven: list[_Pdo] = []
        self.mute = False
        """Whether sending is disabled."""
        for index in {key[0] for key in objects}:
            for base, mapping in ((0x1400, False), (0x1600, True), (0x1800, False), (0x1A00, True)):
                if index - base in _PDOS:
                    self._serve(index, mapping)
        self.rebuild()

    def _serve(self, index: int, mapping: bool) -> None:
        def guard(sub: int, value: int) -> Abort | None:
            check = self._check_mapping if mapping else self._check_communication
            return check(index, sub, value)

        self._objects.guards[index] = guard
        self._objects.watchers[index] = lambda _sub, _value: self.rebuild()

    def rebuild(self) -> None:
        """Resolve the mappings in the object dictionary; discards waiting RPDOs."""
        self._receive = {pdo.identifier: pdo for pdo in self._valid(0x1400)}
        transmit = self._valid(0x1800)
        self._synchronous = [pdo for pdo in transmit if pdo.synchronous]
        self._event_driven = [
            pdo for pdo in transmit if not pdo.synchronous and pdo.kind not in _RTR_TYPES
        ]

    def listens(self, identifier: int) -> bool:
        """Whether it is the identifier of a valid RPDO."""
        return identifier in self._receive

    def waits(self, identifier: int) -> bool:
        """Whether the data of an RPDO take effect at the next SYNC only."""
        return self._receive[identifier].synchronous

    def receive(self, identifier: int, data: bytes) -> None:
        """Take a frame that may be an RPDO."""
        pdo = self._receive.get(identifier)
        if pdo is None:
            return
        if len(data) < pdo.length:
            self._short()
        elif pdo.synchronous:
            pdo.waiting = data
        else:
            pdo.receive(data)

    def latch(self) -> None:
        """SYNC: apply the waiting RPDOs."""
        for pdo in self._receive.values():
            if pdo.waiting is not None:
                data, pdo.waiting = pdo.waiting, None
                pdo.receive(data)

    def on_sync(self, now: float) -> None:
        """SYNC: send the TPDOs that are due."""
        if self._synchronous:
            self._sample()
        for pdo in self._synchronous:
            data = self._objects.packed(pdo.keys)
            pdo.syncs += 1
            due = data != pdo.sent if pdo.kind == 0 else pdo.syncs >= pdo.kind
            if due:
                pdo.syncs = 0
                self._emit(pdo, data, now)

    def poll(self, now: float) -> None:
        """Send the event-driven TPDOs whose data changed or whose timer expired."""
        sampled = False
        for pdo in self._event_driven:
            if now - pdo.sent_at < pdo.inhibit:
                continue
            if not sampled:
                self._sample()
                sampled = True
            data = self._objects.packed(pdo.keys)
            timer = pdo.event > 0 and now - pdo.sent_at >= pdo.event
            if timer or data != pdo.sent:
                self._emit(pdo, data, now)

    def forget(self) -> None:
        """Lose every mapping; all PDOs are then invalid."""
        put, number = self._objects.put, self._objects.number
        for index, sub in self._objects:
            if sub == 1 and (index - 0x1400 in _PDOS or index - 0x1800 in _PDOS):
                put(index, 1, number(index, 1) | _INVALID)
                put(index + 0x200, 0, 0)
        self.rebuild()

    def _emit(self, pdo: _Pdo, data: bytes, now: float) -> None:
        pdo.sent, pdo.sent_at = data, now
        if not self.mute:
            self._send(pdo.identifier, data)

    def _valid(self, base: int) -> list[_Pdo]:
        found = []
        for number in _PDOS:
            key = (base + number, 1)
            if key not in self._objects or self._objects.number(*key) & _INVALID:
                continue
            found.append(self._resolve(base, number))
        return found

    def _resolve(self, base: int, number: int) -> _Pdo:
        objects, record, mapping = self._objects, base + number, base + 0x200 + number
        entries = [objects.number(mapping, sub) for sub in range(1, objects.number(mapping, 0) + 1)]

        def optional(sub: int, unit: float) -> float:
            return objects.number(record, sub) * unit if (record, sub) in objects else 0.0

        keys = tuple((entry >> 16, entry >> 8 & 0xFF) for entry in entries)
        sizes = tuple((entry & 0xFF) // 8 for entry in entries)
        return _Pdo(
            number,
            objects.number(record, 1) & _IDENTIFIER,
            objects.number(record, 2),
            keys,
            sizes,
            objects.receiver(keys, sizes),
            optional(3, _TICK_INHIBIT) if base == 0x1800 else 0.0,
            optional(5, _TICK_EVENT) if base == 0x1800 else 0.0,
        )

    def _check_communication(self, index: int, sub: int, value: int) -> Abort | None:
        present = self._objects.number(index, 1)
        valid = not present & _INVALID
        if sub == 1:
            if value & ~(_INVALID | _NO_RTR | _IDENTIFIER):
                return Abort.RANGE
            moved = (value ^ present) & _IDENTIFIER
            return Abort.STATE if valid and not value & _INVALID and moved else None
        if sub == 2:
            reserved = value in _RESERVED_TYPES or (index < 0x1800 and value in _RTR_TYPES)
            return Abort.RANGE if reserved else None
        return Abort.STATE if sub == 3 and valid else None

    def _check_mapping(self, index: int, sub: int, value: int) -> Abort | None:
        if not self._objects.number(index - 0x200, 1) & _INVALID:
            return Abort.STATE
        if sub == 0:
            return self._check_total(index, value)
        if self._objects.number(index, 0):
            return Abort.STATE
        return self._check_entry(value, receive=index < 0x1800)

    def _check_total(self, index: int, count: int) -> Abort | None:
        if count and (index, count) not in self._objects:
            return Abort.RANGE
        entries = [self._objects.number(index, sub) for sub in range(1, count + 1)]
        if any(entry == 0 for entry in entries):
            return Abort.NO_OBJECT
        return Abort.PDO_LENGTH if sum(entry & 0xFF for entry in entries) > _LONGEST else None

    def _check_entry(self, value: int, receive: bool) -> Abort | None:
        if value == 0:
            return None
        index, sub, bits = value >> 16, value >> 8 & 0xFF, value & 0xFF
        if receive and 0 < index <= _LAST_DUMMY:
            return None if bits % 8 == 0 else Abort.NOT_MAPPABLE
        entry = self._objects.entry((index, sub))
        if isinstance(entry, Abort):
            return Abort.NO_OBJECT
        return None if _can_be_mapped(entry, receive, bits) else Abort.NOT_MAPPABLE


def _can_be_mapped(entry: Entry, receive: bool, bits: int) -> bool:
    access = entry.writable if receive else entry.readable
    return entry.mappable and access and entry.size * 8 == bits
