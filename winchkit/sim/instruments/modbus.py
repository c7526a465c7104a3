"""A simulated Modbus instrument: conversion, filter, tare, status bits, registers."""

from __future__ import annotations

import struct
from collections.abc import Callable
from math import isnan

from winchkit.schema.devices.modbus import (
    REGISTERS,
    CommandSpec,
    FieldSpec,
    ModbusSpec,
    Order,
    StatusMeaning,
    ValueType,
)
from winchkit.sim.instruments.instrument import SimulatedInstrument, in_unit, status_word

_BITS = {"u16": 16, "i16": 16, "u32": 32, "i32": 32}
_DECIMALS = 2
"""Of a simulated indicator, as usual for some hundred newtons."""
_SIGNED = ("i16", "i32")
_ORDERS = {"ABCD": (0, 1, 2, 3), "CDAB": (2, 3, 0, 1), "BADC": (1, 0, 3, 2), "DCBA": (3, 2, 1, 0)}
_SHORT_ORDERS = {"ABCD": (0, 1), "CDAB": (0, 1), "BADC": (1, 0), "DCBA": (1, 0)}


def counts_of(field: FieldSpec, value: float) -> tuple[float, bool]:
    """Counts of a value in the field's unit, and whether they had to be clipped to its range."""
    counts = value / field.scale * 10.0 ** decimals_of(field)
    if field.type == "f32":
        return counts, False
    whole = round(counts)
    bits = _BITS[field.type]
    if field.sign_bit is not None:
        high = (1 << bits) - 1
        low = -high
    elif field.type in _SIGNED:
        low, high = -(1 << (bits - 1)), (1 << (bits - 1)) - 1
    else:
        low, high = 0, (1 << bits) - 1
    return min(max(whole, low), high), not low <= whole <= high


def decimals_of(field: FieldSpec) -> int:
    """Decimals of a simulated device, where it has a register for them."""
    return _DECIMALS if field.decimals is not None else 0


def encode(field: FieldSpec, counts: float) -> list[int]:
    """Registers of a field in the order of their addresses; magnitudes where it has a sign bit."""
    return encode_number(
        field.type, field.order, abs(counts) if field.sign_bit is not None else counts
    )


def encode_number(kind: ValueType, order: Order, number: float) -> list[int]:
    """Registers of a number of a type, in the order of their addresses."""
    if kind == "f32":
        data = struct.pack(">f", number)
    else:
        whole = int(number)
        data = whole.to_bytes(_BITS[kind] // 8, "big", signed=kind in _SIGNED and whole < 0)
    placed = _ORDERS[order] if len(data) == 4 else _SHORT_ORDERS[order]
    wire = bytes(data[index] for index in placed)
    return [int.from_bytes(wire[at : at + 2], "big") for at in range(0, len(wire), 2)]


_STABLE_COUNTS = 100
"""Change of the count between conversions below which the load is stable: above the noise at rest
(some tens of counts), below a load that is put on (rule of thumb)."""
_IDENTITY = 4711
"""Serial number and similar data of every simulated instrument."""


class ModbusInstrument(SimulatedInstrument):
    """One device on a Modbus line; ``measure`` gives the quantity in the unit of the device.

    Registers show a conversion when it is as old as the declared filter delay.
    """

    KIND = "a simulated Modbus instrument"
    FAULTS = (
        "silence",
        "late reply",
        "exception",
        "frozen",
        "overload",
        "sensor break",
        "recover",
    )

    def __init__(self, spec: ModbusSpec, measure: Callable[[], float], *, now: float) -> None:
        super().__init__(measure, spec.rate, spec.filter_delay, now=now)
        self.spec = spec
        self._peak = 0.0
        self._unlocked: list[tuple[int, int]] = []
        self.reply_delay = 2 * spec.longest_reply
        """Delay of a late reply, s; twice the longest one that the device file declares."""

    def _showing(self) -> None:
        if not self._shown.broken:
            self._peak = max(self._peak, self.gross)

    # Interface for the master.

    @property
    def addresses(self) -> list[int]:
        """Registers that exist: fields, status, commands, and one past the block that is read.

        With the register past the block a master can read one more, unless the device answers only
        one length.
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
        """Contents of the registers in use, by address."""
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
        """Execute a write of registers; False where they have no such command."""
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
                self._carry_out(name, command)
                return True
        return False

    def _carry_out(self, name: str, command: CommandSpec) -> None:
        self.stored += command.permanent
        if name == "peak":
            self._peak = 0.0 if isnan(self.gross) else self.gross
        else:
            self._obey(name)

    def _value(self, field: FieldSpec) -> float:
        if field.name == "peak":
            return self._peak
        return self.gross if field.name == "gross" else self.gross - self._tare

    def _status(self, clipped: bool) -> int:
        shown = next(field for field in self.spec.field if field.name == self.spec.value)
        scale = shown.scale / 10.0 ** decimals_of(shown)
        stable = self._converter.motion < _STABLE_COUNTS * scale
        says: dict[StatusMeaning, bool] = {
            "fault": self._shown.broken,
            "overload": clipped or self._shown.overload,
            "stable": stable,
            "unstable": not stable,
            "net": self._net,
            "zero": abs(self.gross) < scale / 4,
            "valid": not self._shown.broken,
        }
        return status_word(self.spec.status, says)


def in_unit_of(spec: ModbusSpec, measure: Callable[[], float]) -> Callable[[], float]:
    """Convert a measurement in SI to the unit of the device's value."""
    return in_unit(next(one.unit for one in spec.field if one.name == spec.value), measure)
