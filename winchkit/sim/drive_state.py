"""The state machine of CiA 402 as a table, and what a control word asks of it."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

__all__ = ["FAULT_RESET", "HALT", "TRANSITIONS", "Command", "State", "Transition", "command_of"]

FAULT_RESET = 0x0080
HALT = 0x0100


class State(IntEnum):
    """The value is the status word's bits 0 to 3, 5 and 6."""

    NOT_READY = 0x00
    SWITCH_ON_DISABLED = 0x40
    READY = 0x21
    SWITCHED_ON = 0x23
    OPERATION_ENABLED = 0x27
    QUICK_STOP_ACTIVE = 0x07
    FAULT_REACTION = 0x0F
    FAULT = 0x08


class Command(IntEnum):
    """What bits 0 to 3 of a control word ask for."""

    DISABLE_VOLTAGE = 0
    QUICK_STOP = 1
    SHUTDOWN = 2
    SWITCH_ON = 3
    ENABLE = 4


class Transition(NamedTuple):
    """A row of the standard's table."""

    number: int
    target: State


TRANSITIONS: dict[tuple[State, Command], Transition] = {
    (State.SWITCH_ON_DISABLED, Command.SHUTDOWN): Transition(2, State.READY),
    (State.READY, Command.SWITCH_ON): Transition(3, State.SWITCHED_ON),
    (State.READY, Command.ENABLE): Transition(3, State.SWITCHED_ON),
    (State.SWITCHED_ON, Command.ENABLE): Transition(4, State.OPERATION_ENABLED),
    (State.OPERATION_ENABLED, Command.SWITCH_ON): Transition(5, State.SWITCHED_ON),
    (State.SWITCHED_ON, Command.SHUTDOWN): Transition(6, State.READY),
    (State.READY, Command.QUICK_STOP): Transition(7, State.SWITCH_ON_DISABLED),
    (State.READY, Command.DISABLE_VOLTAGE): Transition(7, State.SWITCH_ON_DISABLED),
    (State.OPERATION_ENABLED, Command.SHUTDOWN): Transition(8, State.READY),
    (State.OPERATION_ENABLED, Command.DISABLE_VOLTAGE): Transition(9, State.SWITCH_ON_DISABLED),
    (State.SWITCHED_ON, Command.QUICK_STOP): Transition(10, State.SWITCH_ON_DISABLED),
    (State.SWITCHED_ON, Command.DISABLE_VOLTAGE): Transition(10, State.SWITCH_ON_DISABLED),
    (State.OPERATION_ENABLED, Command.QUICK_STOP): Transition(11, State.QUICK_STOP_ACTIVE),
    (State.QUICK_STOP_ACTIVE, Command.DISABLE_VOLTAGE): Transition(12, State.SWITCH_ON_DISABLED),
    (State.QUICK_STOP_ACTIVE, Command.ENABLE): Transition(16, State.OPERATION_ENABLED),
}
"""Transitions by command. 0, 1 (boot), 13, 14 (fault) and 15 (reset) need none."""


def command_of(word: int) -> Command:
    """Decode a control word; bits that a command ignores do not count."""
    if not word & 0b0010:
        return Command.DISABLE_VOLTAGE
    if not word & 0b0100:
        return Command.QUICK_STOP
    if not word & 0b0001:
        return Command.SHUTDOWN
    return Command.ENABLE if word & 0b1000 else Command.SWITCH_ON
