"""Registers of one query turned into a value in SI or NaN, with flags."""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from winchkit.drivers.reading import Quality, StatusWord
from winchkit.errors import Fault, FileError
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.devices.modbus import (
    REGISTERS,
    FieldSpec,
    ModbusSpec,
    Order,
    ReadBlock,
    ValueType,
)
from winchkit.units import convert, dimension_of

_FORMAT: dict[ValueType, str] = {"u16": ">H", "i16": ">h", "u32": ">I", "i32": ">i", "f32": ">f"}


def number_of(kind: ValueType, order: Order, words: Mapping[int, int], at: int) -> float:
    """The number whose first register is ``at``; NaN and infinity as they come."""
    count = REGISTERS[kind]
    wire = b"".join(words[at + k].to_bytes(2, "big") for k in range(count))
    letters = _letters(order, count)
    ordered = bytes(wire[letters.index(letter)] for letter in sorted(letters))
    return float(struct.unpack(_FORMAT[kind], ordered)[0])


def words_of(kind: ValueType, order: Order, number: float) -> list[int]:
    """Registers of a number; raises ``struct.error`` for one beyond the type's range."""
    data = struct.pack(_FORMAT[kind], number if kind == "f32" else int(number))
    letters = _letters(order, len(data) // 2)
    wire = bytes(data[sorted(letters).index(letter)] for letter in letters)
    return [int.from_bytes(wire[at : at + 2], "big") for at in range(0, len(wire), 2)]


def _letters(order: Order, count: int) -> str:
    """Order of the bytes on the wire, ``AB`` or ``BA`` for one register."""
    if count == 2:
        return order
    return "AB" if order in ("ABCD", "CDAB") else "BA"


_TINIEST = 1e-30
"""A float below it, but not zero, is no measurement: its bytes stand in another order."""
_TINIEST_SHARE = 1e-12
"""The same where the device's largest number is known; no converter resolves that."""
_TURNED: Mapping[Order, Order] = {"ABCD": "CDAB", "CDAB": "ABCD", "BADC": "DCBA", "DCBA": "BADC"}
"""The same bytes with the words the other way round."""
_NEAR_ZERO = 1.0
"""Counts; where the status says that the gross value is within a quarter of a count of zero."""


class RegisterContent(NamedTuple):
    """Content of one block of registers."""

    value: float
    gross: float
    counts: float
    quality: Quality
    status: int


class RegisterDecoder:
    """Decoder of the registers of one type of device."""

    def __init__(self, device: DeviceSpec) -> None:
        """Raise FileError where the device file contradicts itself."""
        if device.modbus is None:
            raise FileError(Fault("is no Modbus instrument", device.path))
        self.spec: ModbusSpec = device.modbus
        broken = [Fault(message, device.path, key=key) for key, message in self.spec.rules()]
        if broken:
            raise FileError(broken)
        by_name = {item.name: item for item in self.spec.field}
        self.field = by_name[self.spec.value]
        self._gross = by_name.get("gross", self.field)
        self.dimension = dimension_of(self.field.unit) or ""
        self.status = StatusWord(self.spec.status)

    def decode(
        self, registers: Sequence[int], status_registers: Sequence[int] = ()
    ) -> RegisterContent:
        """Value and gross value (SI or NaN), signed counts, quality, status word."""
        words = _placed(self.spec.read, registers) | _placed(
            self.spec.status_read, status_registers
        )
        status = self._status(words)
        counts = self._counts(self.field, words, status)
        gross = self._counts(self._gross, words, status)
        quality = self.status.quality(status) | self._plausibility(counts, gross, status)
        if not quality.usable:
            return RegisterContent(math.nan, math.nan, counts, quality, status)
        return RegisterContent(
            self._si(self.field, counts, words),
            self._si(self._gross, gross, words),
            counts,
            quality,
            status,
        )

    def word_order(self, registers: Sequence[int]) -> bool | None:
        """Whether the words are in the right order, as far as these show; see ``Consistency``."""
        words, orders = _placed(self.spec.read, registers), list[bool | None]()
        for item in (self.field, self._gross):
            other, limit = _TURNED.get(item.order), item.limit
            if other is None or limit is None or item.type not in ("u32", "i32"):
                continue
            number, turned = (
                abs(number_of(item.type, order, words, item.register))
                for order in (item.order, other)
            )
            orders.append(True if turned > limit else False if number > turned else None)
        return (
            None if not orders else False if False in orders else True if True in orders else None
        )

    def _plausibility(self, counts: float, gross: float, status: int) -> Quality:
        """Flags of numbers that contradict each other, or a status that declares them valid."""
        if not (math.isfinite(counts) and math.isfinite(gross)):
            return Quality.FAULT
        if not self.status.quality(status).usable:
            return Quality.GOOD
        implausible = any(
            _is_implausible(item, number)
            for item, number in ((self.field, counts), (self._gross, gross))
        )
        if self.status.has("zero", status) and self._gross.type != "f32":
            implausible |= abs(gross) > _NEAR_ZERO
        return Quality.MISMATCH if implausible else Quality.GOOD

    def _status(self, words: Mapping[int, int]) -> int:
        at = self.spec.status_register
        if at is None:
            return 0
        number = number_of(self.spec.status_type, self.spec.status_order, words, at)
        return int(number) if 0 <= number < 1 << 32 else -1

    def _counts(self, item: FieldSpec, words: Mapping[int, int], status: int) -> float:
        counts = number_of(item.type, item.order, words, item.register)
        negative = item.sign_bit is not None and status >> item.sign_bit & 1
        return -counts if negative else counts

    def _si(self, item: FieldSpec, counts: float, words: Mapping[int, int]) -> float:
        scale = item.scale
        if (place := item.decimals) is not None:
            scale /= 10.0 ** (words[place.register] >> place.bit & (1 << place.bits) - 1)
        return convert(counts * scale, item.unit, self.dimension)


def _placed(block: ReadBlock | None, registers: Sequence[int]) -> dict[int, int]:
    return {} if block is None else dict(enumerate(registers, block.start))


def _is_implausible(item: FieldSpec, counts: float) -> bool:
    """Whether no intact device shows this number."""
    if item.limit is not None and abs(counts) > item.limit:
        return True
    tiniest = _TINIEST if item.limit is None else _TINIEST_SHARE * item.limit
    return item.type == "f32" and 0 < abs(counts) < tiniest
