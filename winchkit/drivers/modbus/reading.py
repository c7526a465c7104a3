"""Registers of one query turned into a reading: a value in SI or NaN, with flags."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Flag, auto
from typing import NamedTuple

from winchkit.errors import Fault, FileError
from winchkit.schema.device import DeviceSpec, FieldSpec, ModbusSpec, StatusMeaning
from winchkit.units import convert, dimension_of

__all__ = ["Decoded", "Decoder", "Quality", "Reading"]

_FORMAT = {"u16": ">H", "i16": ">h", "u32": ">I", "i32": ">i", "f32": ">f"}


class Quality(Flag):
    """What is to be said against a reading; GOOD is nothing."""

    GOOD = 0
    OVERLOAD = auto()
    UNDERLOAD = auto()
    UNSTABLE = auto()
    FAULT = auto()
    DUPLICATE = auto()
    """The same count as before: perhaps the same conversion, read twice."""
    LATE = auto()
    """The reply took so long that the moment of sampling is uncertain."""

    @property
    def usable(self) -> bool:
        """Whether the value is a measurement at all."""
        return not self & (Quality.OVERLOAD | Quality.UNDERLOAD | Quality.FAULT)

    def __str__(self) -> str:
        return ", ".join(flag.name.lower() for flag in self if flag.name) or "good"


_FLAGS: dict[StatusMeaning, Quality] = {
    "overload": Quality.OVERLOAD,
    "underload": Quality.UNDERLOAD,
    "fault": Quality.FAULT,
    "unstable": Quality.UNSTABLE,
}


@dataclass(frozen=True, slots=True)
class Reading:
    """One answer of an instrument; times are on the bench's clock, s."""

    value: float
    """SI; NaN where the flags say that it is no measurement."""
    gross: float
    """The value before any tare, where the device has a field ``gross``; else the value."""
    raw: float
    """Counts as read, with their sign."""
    quality: Quality
    t_request: float
    t_receive: float
    t_sample: float
    """Estimate of the moment that the value belongs to: filter and conversion taken off."""
    t_uncertainty: float
    """Half the interval in which that moment lies, s."""


class Decoded(NamedTuple):
    """What one block of registers says."""

    value: float
    gross: float
    counts: float
    quality: Quality
    status: int


class Decoder:
    """Reads the measurement of one kind of device out of its block of registers."""

    def __init__(self, device: DeviceSpec) -> None:
        """Raise FileError where the device file contradicts itself."""
        if device.modbus is None:
            raise FileError(Fault("is no Modbus instrument", device.path))
        self.spec: ModbusSpec = device.modbus
        by_name = {item.name: item for item in self.spec.field}
        if self.spec.value not in by_name:
            raise FileError(
                Fault(
                    f"'{self.spec.value}' is no field; use one of {', '.join(by_name)}",
                    device.path,
                    key="modbus.value",
                )
            )
        self.field = by_name[self.spec.value]
        self._gross = by_name.get("gross", self.field)
        dimension = dimension_of(self.field.unit)
        if dimension is None:
            raise FileError(Fault(f"unknown unit '{self.field.unit}'", device.path))
        self.dimension = dimension
        self._masks = {
            meaning: sum(1 << bit for bit in bits) for meaning, bits in self.spec.status.items()
        }
        self._check_block(device.path)

    def _check_block(self, path: str) -> None:
        block = self.spec.read
        last = self.field.register + (2 if self.field.type.endswith("32") else 1)
        status = self.spec.status_register
        inside = block.start <= self.field.register and last <= block.start + block.count
        if status is not None:
            inside &= block.start <= status < block.start + block.count
        if not inside:
            raise FileError(
                Fault(
                    f"the block {block.start} to {block.start + block.count - 1} does not hold "
                    f"'{self.field.name}' and the status, so they would not belong together",
                    path,
                    key="modbus.read",
                )
            )

    def decode(self, registers: Sequence[int]) -> Decoded:
        """Value and gross value (SI or NaN), signed counts, quality, status word of one block."""
        block = self.spec.read
        status = 0
        if self.spec.status_register is not None:
            status = registers[self.spec.status_register - block.start]
        counts = self._counts(self.field, registers, status)
        gross = self._counts(self._gross, registers, status)
        quality = self._quality(status)
        if not math.isfinite(counts):
            quality |= Quality.FAULT
        if not quality.usable:
            return Decoded(math.nan, math.nan, counts, quality, status)
        return Decoded(
            self._si(self.field, counts), self._si(self._gross, gross), counts, quality, status
        )

    def _counts(self, item: FieldSpec, registers: Sequence[int], status: int) -> float:
        counts = _number(item, registers, item.register - self.spec.read.start)
        negative = item.sign_bit is not None and status >> item.sign_bit & 1
        return -counts if negative else counts

    def _si(self, item: FieldSpec, counts: float) -> float:
        return convert(counts * item.scale, item.unit, self.dimension)

    def has(self, meaning: StatusMeaning, status: int) -> bool:
        """Whether a status word says ``meaning``, e.g. that a tare is active."""
        return bool(status & self._masks.get(meaning, 0))

    def _quality(self, status: int) -> Quality:
        quality = Quality.GOOD
        for meaning, flag in _FLAGS.items():
            if self.has(meaning, status):
                quality |= flag
        if "stable" in self.spec.status and not self.has("stable", status):
            quality |= Quality.UNSTABLE
        return quality


def _number(item: FieldSpec, registers: Sequence[int], at: int) -> float:
    """Number of a field whose first register stands at ``at``."""
    words = 2 if item.type.endswith("32") else 1
    wire = b"".join(word.to_bytes(2, "big") for word in registers[at : at + words])
    order = item.order if words == 2 else ("AB" if item.order in ("ABCD", "CDAB") else "BA")
    ordered = bytes(wire[order.index(letter)] for letter in "ABCD"[: 2 * words])
    return float(struct.unpack(_FORMAT[item.type], ordered)[0])
