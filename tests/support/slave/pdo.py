"""PDOs of CiA 301: parameters, mapping with its set-up rules, transmission types and timers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from slave.dictionary import Abort, Dictionary
from slave.frames import Frame

_VALID = 1 << 31
_MS, _INHIBIT = 1e-3, 1e-4
_SHORT, _LATE = 0x8210, 0x8250
_MOST_BITS = 64
_DUMMIES = range(1, 8)


@dataclass
class _Timer:
    """When a PDO was sent or received last, and what waits for a SYNC."""

    last: float | None = None
    held: bytes | None = None
    """Data of a synchronous RPDO, or of a TPDO that was sent last."""
    syncs: int = 0
    late: bool = False


class Pdos:
    """All PDOs of a slave; ``write`` takes objects from RPDOs, ``read`` gives those of TPDOs."""

    def __init__(self, objects: Dictionary, send: Callable[[Frame], None]) -> None:
        self.objects, self._send = objects, send
        self.write: Callable[[int, int, bytes], None] = lambda _i, _s, _d: None
        self.on_emergency: Callable[[int], None] = lambda _code: None
        self.on_late: Callable[[int], None] = lambda _number: None
        self._timers: dict[int, _Timer] = {}
        self._by_event: bool | None = None
        self._identifiers: dict[int, dict[int, int]] = {}
        self._mappings: dict[int, list[tuple[int, int, int]]] = {}

    def reset(self) -> None:
        """Forget what was sent and received."""
        self._timers.clear()
        self._identifiers.clear()
        self._mappings.clear()
        self._by_event = None

    def identifiers(self, first: int) -> dict[int, int]:
        """Numbers of the valid PDOs by identifier; ``first`` is 1400h or 1800h."""
        if first not in self._identifiers:
            found = self._identifiers[first] = {}
            for index, sub in self.objects.entries:
                cob = self.objects.get(index, 1)
                inside = sub == 1 and first <= index < first + 0x200
                if inside and not cob & _VALID and cob & 0x7FF:
                    found[cob & 0x7FF] = index - first + 1
        return self._identifiers[first]

    def by_event(self) -> bool:
        """Whether there is a TPDO that is sent without a SYNC."""
        if self._by_event is None:
            numbers = self.identifiers(0x1800).values()
            self._by_event = any(self.objects.get(0x17FF + n, 2) >= 254 for n in numbers)
        return self._by_event

    def receive(self, number: int, data: bytes, now: float) -> None:
        """An RPDO: acted on at once, or with the next SYNC."""
        timer = self._timer(0x1400, number)
        mapping = self._mapping(0x1600 + number - 1)
        if len(data) < sum(bits for _, _, bits in mapping) // 8:
            self.on_emergency(_SHORT)
            return
        timer.last, timer.late = now, False
        if self.objects.get(0x1400 + number - 1, 2) <= 240:
            timer.held = data
        else:
            self._take(mapping, data)

    def sync(self, now: float) -> None:
        """Act on held RPDOs, then send the synchronous TPDOs."""
        for number in sorted(self.identifiers(0x1400).values()):
            timer = self._timer(0x1400, number)
            if timer.held is not None:
                held, timer.held = timer.held, None
                self._take(self._mapping(0x1600 + number - 1), held)
        for identifier, number in sorted(self.identifiers(0x1800).items(), key=lambda i: i[1]):
            kind = self.objects.get(0x1800 + number - 1, 2)
            timer = self._timer(0x1800, number)
            timer.syncs += 1
            data = self._pack(number)
            due = 1 <= kind <= 240 and timer.syncs >= kind
            if due or (kind == 0 and data != timer.held):
                timer.syncs = 0
                self._transmit(identifier, timer, data, now)

    def advance(self, now: float, *, watches: bool) -> None:
        """Event-driven TPDOs, and the deadlines of RPDOs."""
        for identifier, number in self.identifiers(0x1800).items() if self.by_event() else ():
            record = 0x1800 + number - 1
            if self.objects.get(record, 2) < 254:
                continue
            timer, data = self._timer(0x1800, number), self._pack(number)
            since = None if timer.last is None else now - timer.last
            period = self.objects.get(record, 5) * _MS
            inhibited = since is not None and since < self.objects.get(record, 3) * _INHIBIT
            changed = data != timer.held or (period and since is not None and since >= period)
            if (changed or since is None) and not inhibited:
                self._transmit(identifier, timer, data, now)
        for number in self.identifiers(0x1400).values() if watches else ():
            timer = self._timer(0x1400, number)
            limit = self.objects.get(0x1400 + number - 1, 5) * _MS
            if limit and timer.last is not None and now - timer.last > limit and not timer.late:
                timer.late = True
                self.on_emergency(_LATE)
                self.on_late(number)

    def check_write(self, index: int, sub: int, data: bytes) -> None:
        """Raise Abort where the order of a PDO's set-up is not kept."""
        value = int.from_bytes(data, "little")
        if 0x1400 <= index < 0x1600 or 0x1800 <= index < 0x1A00:
            self._check_communication(index, sub, value)
        elif 0x1600 <= index < 0x1800 or 0x1A00 <= index < 0x1C00:
            self._check_mapping(index, sub, value)

    def written(self, index: int, sub: int) -> None:
        """A PDO parameter was changed: its timers begin anew."""
        if 0x1400 <= index < 0x1C00:
            self._identifiers.clear()
            self._mappings.clear()
            self._by_event = None
            if sub in (1, 2, 5):
                self._timers.pop(index, None)

    def _timer(self, first: int, number: int) -> _Timer:
        return self._timers.setdefault(first + number - 1, _Timer())

    def _mapping(self, index: int) -> list[tuple[int, int, int]]:
        found = self._mappings.get(index)
        if found is None:
            subs = range(1, self.objects.get(index) + 1)
            entries = (self.objects.get(index, sub) for sub in subs)
            found = [(e >> 16, e >> 8 & 0xFF, e & 0xFF) for e in entries]
            self._mappings[index] = found
        return found

    def _take(self, mapping: list[tuple[int, int, int]], data: bytes) -> None:
        start, parts = 0, []
        for index, sub, bits in mapping:
            parts.append((index, sub, data[start : start + bits // 8]))
            start += bits // 8
        # Targets before the control word that acts on them.
        for index, sub, part in sorted(parts, key=lambda item: item[0] == 0x6040):
            if index not in _DUMMIES:
                self.write(index, sub, part)

    def _pack(self, number: int) -> bytes:
        parts = []
        for index, sub, bits in self._mapping(0x1A00 + number - 1):
            entry = self.objects.entries.get((index, sub))
            parts.append((entry.value if entry else b"")[: bits // 8].ljust(bits // 8, b"\0"))
        return b"".join(parts)[:8]

    def _transmit(self, identifier: int, timer: _Timer, data: bytes, now: float) -> None:
        timer.last, timer.held = now, data
        self._send(Frame(identifier, data))

    def _check_communication(self, index: int, sub: int, value: int) -> None:
        valid = not self.objects.get(index, 1) & _VALID
        if sub == 1 and valid and not value & _VALID:
            changed = (value ^ self.objects.get(index, 1)) & 0x3FFFFFFF
            if changed:
                raise Abort(0x06090030)
        elif sub == 2 and 241 <= value <= (251 if index >= 0x1800 else 253):
            raise Abort(0x06090030)
        elif sub == 3 and valid and value != self.objects.get(index, 3):
            raise Abort(0x06010000)

    def _check_mapping(self, index: int, sub: int, value: int) -> None:
        # A drive whose COB-IDs are read-only (ElmoSimplIQ.dcf) cannot have its PDOs switched off.
        renames = self.objects.entries[index - 0x200, 1].access not in ("ro", "const")
        if renames and not self.objects.get(index - 0x200, 1) & _VALID:
            raise Abort(0x06010000)
        if sub == 0:
            entries = (self.objects.get(index, number) for number in range(1, value + 1))
            if sum(entry & 0xFF for entry in entries) > _MOST_BITS:
                raise Abort(0x06040042)
            return
        if self.objects.get(index):
            raise Abort(0x06010000)
        self._check_entry(value, receives=index < 0x1A00)

    def _check_entry(self, value: int, *, receives: bool) -> None:
        key = value >> 16, value >> 8 & 0xFF
        if not value or (receives and key[0] in _DUMMIES):
            return
        entry = self.objects.entries.get(key)
        if entry is None:
            raise Abort(0x06020000)
        direction = entry.access not in (("ro", "const", "rwr") if receives else ("wo", "rww"))
        if not entry.mappable or not direction:
            raise Abort(0x06040041)
        if entry.size is not None and value & 0xFF != 8 * entry.size:
            raise Abort(0x06040041)
