"""A simulated Modbus instrument: converts at its rate, filters, tares, sets its status bits."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite

from winchkit.errors import UsageError
from winchkit.schema.device_modbus import ModbusSpec
from winchkit.schema.modbus_parts import REGISTERS, CommandSpec, FieldSpec, StatusMeaning
from winchkit.sim.modbus_registers import counts_of, decimals_of, encode, encode_number
from winchkit.units import convert, dimension_of, factor, suggest

__all__ = ["INSTRUMENT_FAULTS", "ModbusInstrument", "check_kind", "in_unit_of"]

INSTRUMENT_FAULTS = (
    "silence",
    "late reply",
    "exception",
    "frozen",
    "overload",
    "sensor break",
    "recover",
)
"""What can go wrong; ``recover`` ends all of it."""

_STABLE_COUNTS = 100
_IDENTITY = 4711
"""Serial number and the like of every simulated instrument."""
_FAST, _SLOW = 0.05, 0.5


@dataclass(frozen=True)
class _Converted:
    """One conversion, in the unit of the device."""

    due: float
    """When it has passed the filter, s."""
    value: float
    overload: bool = False
    broken: bool = False


class ModbusInstrument:
    """One device on a Modbus line.

    ``measure`` gives the quantity now in the unit of the device. Nobody but :meth:`convert`
    looks at it, at the instants of :attr:`next_conversion`. Registers show a
    conversion when it is as old as the declared filter delay: the filter delays and does not
    smooth, since a lag would be an effect of its own.
    """

    def __init__(self, spec: ModbusSpec, measure: Callable[[], float], *, now: float) -> None:
        self.spec = spec
        self._measure = measure
        self.next_conversion = now
        self._pipeline: deque[_Converted] = deque()
        self._shown = _Converted(now, 0.0)
        self._zero = self._tare = self._peak = 0.0
        self._net = False
        self._unlocked: list[tuple[int, int]] = []
        self.stored = 0
        """How often its EEPROM was written."""
        self._fast: float | None = None
        self._slow: float | None = None
        self.faults: set[str] = set()
        self.reply_delay = 2 * spec.longest_reply
        """How late a late reply is, s; twice what the device declares as its longest."""

    # Time.

    def convert(self) -> None:
        """Sample at the instant ``next_conversion``, which then moves on by one period."""
        now = self.next_conversion
        self.next_conversion = now + 1.0 / self.spec.rate
        if "frozen" in self.faults:
            return
        value = self._measure()
        broken = "sensor break" in self.faults or not isfinite(value)
        due = now + self.spec.filter_delay
        self._pipeline.append(_Converted(due, value, "overload" in self.faults, broken))
        if not broken:
            self._average(value)

    def _average(self, value: float) -> None:
        if self._fast is None or self._slow is None:
            self._fast = self._slow = value
            return
        step = 1.0 / self.spec.rate
        self._fast += (value - self._fast) * min(1.0, step / _FAST)
        self._slow += (value - self._slow) * min(1.0, step / _SLOW)

    def show(self, now: float) -> None:
        """Let the conversions that are through the filter by ``now`` reach the registers."""
        while self._pipeline and self._pipeline[0].due <= now:
            self._shown = self._pipeline.popleft()
            if not self._shown.broken:
                self._peak = max(self._peak, self._shown.value - self._zero)

    # What a master does.

    @property
    def addresses(self) -> list[int]:
        """Registers that exist: fields, status, commands, and one past the block that is read.

        The register past the block lets a master ask for one more, unless the device answers
        one length only.
        """
        found: set[int] = set()
        for block in (self.spec.read, self.spec.status_read):
            if block is not None:
                found.update(range(block.start, block.end + (not block.fixed)))
        for item in (*self.spec.field, *self.spec.identity):
            found.update(range(item.register, item.register + REGISTERS[item.type]))
        for command in self.spec.command.values():
            found.update(range(command.register, command.register + REGISTERS[command.type]))
            found.update(step.register for step in command.unlock)
        if (at := self.spec.status_register) is not None:
            found.update(range(at, at + REGISTERS[self.spec.status_type]))
        return sorted(found)

    def registers(self) -> dict[int, int]:
        """Contents of the registers that carry something, by address."""
        contents: dict[int, int] = {}
        status = 0
        clipped = False
        for field in self.spec.field:
            counts, beyond = counts_of(field, 0.0 if self._shown.broken else self._value(field))
            clipped |= beyond
            if field.sign_bit is not None and counts < 0:
                status |= 1 << field.sign_bit
            contents.update(enumerate(encode(field, counts), field.register))
            if field.decimals is not None:
                at = field.decimals.register
                told = decimals_of(field) << field.decimals.bit
                if at == self.spec.status_register:
                    status |= told
                else:
                    contents[at] = told
        for item in self.spec.identity:
            contents.update(enumerate(encode(item, _IDENTITY), item.register))
        if self.spec.status_register is not None:
            words = encode_number(
                self.spec.status_type, self.spec.status_order, status | self._status(clipped)
            )
            contents.update(enumerate(words, self.spec.status_register))
        return contents

    def command(self, register: int, *words: int) -> bool:
        """Obey a write of registers; False where they take no such command."""
        for name, command in self.spec.command.items():
            steps = [(step.register, step.value) for step in command.unlock]
            if (register, words[0]) in steps and len(words) == 1:
                self._unlocked.append((register, words[0]))
                return True
            wanted = encode_number(command.type, command.order, command.value)
            if (register, list(words)) == (command.register, wanted):
                unlocked, self._unlocked = self._unlocked, []
                if unlocked[-len(steps) :] != steps:
                    return False
                self._obey(name, command)
                return True
        return False

    def inject(self, kind: str) -> None:
        """Make something go wrong; raises UsageError for an unknown kind."""
        check_kind(kind)
        if kind == "recover":
            self.faults.clear()
        else:
            self.faults.add(kind)

    def _obey(self, name: str, command: CommandSpec) -> None:
        gross = self._shown.value - self._zero
        self.stored += command.permanent
        if name == "zero":
            self._zero = self._shown.value
        elif name == "tare":
            self._tare, self._net = gross, True
        elif name == "gross":
            self._tare, self._net = 0.0, False
        elif name == "peak":
            self._peak = gross

    def _value(self, field: FieldSpec) -> float:
        gross = self._shown.value - self._zero
        if field.name == "peak":
            return self._peak
        return gross if field.name == "gross" else gross - self._tare

    def _status(self, clipped: bool) -> int:
        shown = next(field for field in self.spec.field if field.name == self.spec.value)
        scale = shown.scale / 10.0 ** decimals_of(shown)
        fast, slow = self._fast, self._slow
        moved = abs(fast - slow) if fast is not None and slow is not None else 0.0
        stable = moved < _STABLE_COUNTS * scale
        says: dict[StatusMeaning, bool] = {
            "fault": self._shown.broken,
            "overload": clipped or self._shown.overload,
            "stable": stable,
            "unstable": not stable,
            "net": self._net,
            "zero": abs(self._shown.value - self._zero) < scale / 4,
            "valid": not self._shown.broken,
        }
        bits = 0
        for meaning, numbers in self.spec.status.items():
            if says.get(meaning, False):
                bits |= 1 << numbers[0]
        return bits


def check_kind(kind: str) -> None:
    """Raise UsageError for a fault that no simulated instrument has."""
    if kind not in INSTRUMENT_FAULTS:
        raise UsageError(
            f"a simulated instrument has no fault '{kind}'; use one of "
            f"{', '.join(INSTRUMENT_FAULTS)}" + suggest(kind, list(INSTRUMENT_FAULTS))
        )


def in_unit_of(spec: ModbusSpec, measure: Callable[[], float]) -> Callable[[], float]:
    """Turn a measurement in SI into one in the unit of the device's value."""
    unit = next(field.unit for field in spec.field if field.name == spec.value)
    dimension = dimension_of(unit)
    if dimension is None:
        raise UsageError(f"unknown unit '{unit}' of a simulated instrument")
    size, origin = factor(unit, dimension), convert(0.0, unit, dimension)
    return lambda: (measure() - origin) / size
