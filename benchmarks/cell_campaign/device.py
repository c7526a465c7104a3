"""A device as its file declares it: registers that never show the same number twice."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from random import Random

from winchkit.schema.devices.modbus import REGISTERS, FieldSpec, ModbusSpec

_PACK = {"u16": ">H", "i16": ">h", "u32": ">I", "i32": ">i", "f32": ">f"}
_FULL = {"u16": 60_000, "i16": 30_000, "u32": 900_000, "i32": 900_000, "f32": 900_000}
_BAD_FLOATS = (0x7FC00000, 0x7F800000, 0xFF800000, 0x7FBFFFFF, 0xFFFFFFFF)


@dataclass
class Device:
    """Composes its registers anew for every query, and remembers when it showed what."""

    spec: ModbusSpec
    random: Random
    shown: dict[float, float] = field(default_factory=dict)
    """Time at which it showed each number of counts."""
    overload: bool = False
    overload_until: float = 0.0
    not_a_number: bool = False
    frozen: bool = False
    largest: int = 0
    """Counts it shows at most, repeated at will, where not 0: a cell with nothing on it."""
    _counts: float | None = None

    def words(self, now: float) -> dict[int, int]:
        """Contents of all registers at this moment."""
        status, words = self._plain_status(), dict[int, int]()
        counts = self._fresh(now)
        for item in self.spec.field:
            number = counts if item.name == self.spec.value else 0.0
            if item.name == "gross":
                number = counts
            if self.overload:
                number = float(self.random.randrange(1, 1000))
            if item.sign_bit is not None and number < 0:
                status |= 1 << item.sign_bit
                number = -number
            words.update(enumerate(self._encoded(item, number), item.register))
        place = self.spec.field[0].decimals
        if place is not None and place.register == self.spec.status_register:
            status |= 2 << place.bit
        at = self.spec.status_register
        if at is not None:
            wire = encode(self.spec.status_type, self.spec.status_order, status)
            words.update(enumerate(wire, at))
        return words

    def _fresh(self, now: float) -> float:
        """Counts that were never shown before, unless it hangs."""
        if self.largest:
            counts = float(self.random.randrange(self.largest + 1))
            self.shown[counts] = now
            return counts
        if self.frozen and self._counts is not None:
            self.shown[self._counts] = now
            return self._counts
        item = next(one for one in self.spec.field if one.name == self.spec.value)
        full = min(_FULL[item.type], int(item.limit or _FULL[item.type]))
        signed = item.sign_bit is not None or item.type.startswith(("i", "f"))
        while True:
            counts = float(self.random.randrange(-full if signed else 1, full))
            if counts not in self.shown and abs(counts) > 100:
                break
        self._counts = counts
        if not self.overload and not self.not_a_number:
            self.shown[counts] = now
        return counts

    def _plain_status(self) -> int:
        bits = 0
        for meaning in ("stable", "valid"):
            for bit in self.spec.status.get(meaning, ())[:1]:
                bits |= 1 << bit
        if self.overload:
            wanted = self.spec.status.get("overload") or self.spec.status.get("fault") or ()
            bits |= sum(1 << bit for bit in wanted[:1])
        return bits

    def _encoded(self, item: FieldSpec, number: float) -> list[int]:
        if self.not_a_number and item.type == "f32":
            bits = self.random.choice(_BAD_FLOATS)
            data = bits.to_bytes(4, "big")
            return _ordered(data, item.order)
        return encode(item.type, item.order, number)

    @property
    def can_overload(self) -> bool:
        """Whether it has a way to say so."""
        return bool(self.spec.status.get("overload") or self.spec.status.get("fault"))

    @property
    def is_float(self) -> bool:
        """Whether it can show what is no number."""
        return any(item.type == "f32" and item.name == self.spec.value for item in self.spec.field)


def encode(kind: str, order: str, number: float) -> list[int]:
    """Registers of a number, by permuting its bytes as the letters say."""
    data = struct.pack(_PACK[kind], number if kind == "f32" else int(number))
    return _ordered(data, order)


def _ordered(data: bytes, order: str) -> list[int]:
    letters = order if len(data) == 4 else ("AB" if order in ("ABCD", "CDAB") else "BA")
    wire = bytes(data["ABCD".index(letter)] for letter in letters)
    assert len(wire) == 2 * REGISTERS["u32" if len(data) == 4 else "u16"]
    return list(struct.unpack(f">{len(wire) // 2}H", wire))
