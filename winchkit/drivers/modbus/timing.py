"""How long an exchange takes on a line, and what rates a line allows its instruments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from winchkit.drivers.modbus.distrust import LISTENING
from winchkit.schema.bench import BusSpec
from winchkit.schema.device_modbus import ModbusSpec
from winchkit.schema.modbus_parts import ReadBlock

__all__ = ["Exchange", "exchange", "fair_rates", "wire_times"]

_REQUEST = 8
_ANSWER = 5
"""Unit, function, byte count and check sum around the registers."""
_SILENT_CHARACTERS = 3.5
_SHORTEST_SILENCE = 1.75e-3
"""Above 19200 Bd the specification fixes the silence between frames to this, s."""
_TURNAROUND = {"modbus-rtu": 2e-3, "modbus-tcp": 0.3e-3}
"""What a device and this machine take between the request's end and the answer's beginning, s."""
_USE = 0.95
"""Of a line: the rest is for commands, retries and the machine's own jitter."""


@dataclass(frozen=True)
class Exchange:
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


def exchange(spec: ModbusSpec, bus: BusSpec) -> Exchange:
    """The time that one reading of a device takes on a line, as the standard has it."""
    blocks = [block for block in (spec.read, spec.status_read) if block is not None]
    size = sum(_bytes(block) for block in blocks)
    if bus.kind == "modbus-tcp":
        wire = silence = 0.0
    else:
        character = _bits(bus) / bus.baudrate
        wire = size * character
        silence = 2 * len(blocks) * max(_SILENT_CHARACTERS * character, _SHORTEST_SILENCE)
        if spec.read.fixed or len(blocks) > 1:
            silence += len(blocks) * LISTENING
    return Exchange(
        size,
        wire,
        max(silence, len(blocks) * spec.gap),
        len(blocks) * _TURNAROUND[bus.kind],
        len(blocks),
    )


def fair_rates(wanted: Sequence[float], times: Sequence[float]) -> tuple[float, ...]:
    """Rates (1/s) for instruments on one line, each of which takes ``times`` s for a reading.

    Everybody gets what it wants or the same as everybody else who does not, so that the line is
    full: the max-min fair share.
    """
    rates = [0.0] * len(wanted)
    free, left = _USE, sorted(range(len(wanted)), key=lambda k: wanted[k])
    while left:
        share = free / sum(times[k] for k in left)
        first = left.pop(0)
        rates[first] = min(wanted[first], share)
        free -= rates[first] * times[first]
    return tuple(rates)


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
