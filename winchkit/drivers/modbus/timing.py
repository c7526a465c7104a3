"""How long an exchange takes on a Modbus line."""

from __future__ import annotations

from dataclasses import dataclass

from winchkit.drivers.modbus.late_replies import LISTENING
from winchkit.schema.bench import BusSpec
from winchkit.schema.devices.modbus import ModbusSpec, ReadBlock

_REQUEST = 8
"""Bytes of a read request: unit, function, address, count and check sum."""
_ANSWER = 5
"""Unit, function, byte count and check sum around the registers."""
_SILENT_CHARACTERS = 3.5
"""Silence between RTU frames, in characters (Modbus over serial line, section 2.5.1.1)."""
_SHORTEST_SILENCE = 1.75e-3
"""Above 19200 Bd the specification fixes the silence between frames to this, s."""
_TURNAROUND = {"modbus-rtu": 2e-3, "modbus-tcp": 0.3e-3}
"""What a device and this machine take between the request's end and the answer's beginning, s."""


@dataclass(frozen=True)
class ReadingTiming:
    """Where the time of one reading goes, s."""

    bytes: int
    wire: float
    silence: float
    turnaround: float
    queries: int = 1

    @property
    def time(self) -> float:
        """Of the whole reading."""
        return self.wire + self.silence + self.turnaround


def exchange(spec: ModbusSpec, bus: BusSpec) -> ReadingTiming:
    """The time that one reading of a device takes on a line, as the standard has it."""
    blocks = [block for block in (spec.read, spec.status_read) if block is not None]
    size = sum(_bytes(block) for block in blocks)
    silence = 2 * len(blocks) * silence_of(bus)
    wire = 0.0
    if bus.kind == "modbus-rtu":
        wire = size * _bits(bus) / bus.baudrate
        if any(block.fixed for block in blocks):
            silence += len(blocks) * LISTENING
    return ReadingTiming(
        size,
        wire,
        max(silence, len(blocks) * spec.gap),
        len(blocks) * _TURNAROUND[bus.kind],
        len(blocks),
    )


def silence_of(bus: BusSpec) -> float:
    """Silence that separates frames, s: three and a half characters on a serial line."""
    if bus.kind == "modbus-tcp":
        return 0.0
    return max(_SILENT_CHARACTERS * _bits(bus) / bus.baudrate, _SHORTEST_SILENCE)


def wire_times(spec: ModbusSpec, bus: BusSpec) -> tuple[float, float]:
    """How long request and answer of the value's block are on the wire, s."""
    if bus.kind == "modbus-tcp":
        return 0.0, 0.0
    character = _bits(bus) / bus.baudrate
    return _REQUEST * character, (_ANSWER + 2 * spec.read.count) * character


def _bytes(block: ReadBlock) -> int:
    return _REQUEST + _ANSWER + 2 * block.count + (not block.fixed)


def _bits(bus: BusSpec) -> int:
    return 9 + bus.stopbits + (bus.parity != "N")
