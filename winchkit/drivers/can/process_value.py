"""The process value of a CANopen instrument and its status, as a value in SI or NaN with flags."""

from __future__ import annotations

import math
import struct

from winchkit.drivers.can.node import SdoNode
from winchkit.drivers.can.pdo import parse_object
from winchkit.drivers.reading import Quality
from winchkit.drivers.status_word import StatusWord
from winchkit.errors import Fault, FileError
from winchkit.schema.device import DeviceSpec
from winchkit.units import convert, dimension_of

__all__ = ["ProcessDecoder"]

_REAL32_BITS = 32
_TINIEST = 1e-30
"""A float below it, but not zero, is no measurement: its bytes are of another type."""


class ProcessDecoder:
    """Reads what one kind of CANopen instrument says."""

    def __init__(self, device: DeviceSpec, node: SdoNode) -> None:
        """Raise FileError where the device file contradicts itself or its EDS."""
        if device.process is None:
            raise FileError(Fault("is no CANopen instrument", device.path))
        self.spec = spec = device.process
        item = node.mapped(*parse_object(spec.value))
        self._bits, self._signed = item.bits, item.signed
        if spec.type == "f32" and (item.bits, item.signed) != (_REAL32_BITS, False):
            raise FileError(
                Fault(f"{spec.value} is no REAL32 in the EDS", device.path, key="process.type")
            )
        self._dimension = dimension_of(spec.unit) or ""
        self.status = StatusWord(spec.bits)

    def decode(self, raw: int, status: int) -> tuple[float, float, Quality]:
        """Value (SI or NaN), counts, flags of a raw object and its status."""
        counts = float(raw)
        if self.spec.type == "f32":
            counts = float(struct.unpack("<f", struct.pack("<I", raw))[0])
        quality = self.status.quality(status)
        if not math.isfinite(counts):
            quality |= Quality.FAULT
        elif quality.usable and self._strange(counts):
            quality |= Quality.MISMATCH
        if not quality.usable:
            return math.nan, counts, quality
        return convert(counts * self.spec.scale, self.spec.unit, self._dimension), counts, quality

    def _strange(self, counts: float) -> bool:
        """Whether no device in good order shows this number."""
        beyond = self.spec.limit is not None and abs(counts) > self.spec.limit
        return beyond or (self.spec.type == "f32" and 0 < abs(counts) < _TINIEST)
