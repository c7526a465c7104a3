"""Power drive system state machine of CiA 402-2 as tables, and the controlword for a request.

No communication. Every way to stop uses quick stop (02h) and disable voltage
(00h) only and can therefore never energise a drive, whatever state it is in.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntEnum


class DriveState(IntEnum):
    """States of the power state machine; UNKNOWN is a status word that fits none."""

    UNKNOWN = -1
    NOT_READY_TO_SWITCH_ON = 0
    SWITCH_ON_DISABLED = 1
    READY_TO_SWITCH_ON = 2
    SWITCHED_ON = 3
    OPERATION_ENABLED = 4
    QUICK_STOP_ACTIVE = 5
    FAULT_REACTION_ACTIVE = 6
    FAULT = 7

    def __str__(self) -> str:
        return _STATE_WORDS[self + 1]


_STATE_WORDS = tuple(state.name.lower().replace("_", " ") for state in DriveState)
POWERED = (
    DriveState.OPERATION_ENABLED,
    DriveState.QUICK_STOP_ACTIVE,
    DriveState.FAULT_REACTION_ACTIVE,
)
"""States in which the power stage may turn the motor."""
FAULTS = (DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE)


def has_left(state: DriveState) -> bool:
    """Whether a drive is known not to be in operation enabled; an unknown state proves nothing."""
    return state not in (DriveState.OPERATION_ENABLED, DriveState.UNKNOWN)


class StatusBit(IntEnum):
    """Bits of the status word 6041h beside the state."""

    WARNING = 1 << 7
    TARGET_REACHED = 1 << 10
    INTERNAL_LIMIT = 1 << 11


class RequestedState(Enum):
    """Requested state of a drive."""

    ENABLE = "enable"
    RUN_DOWN = "run down"
    """Stay enabled while a ramp brings it to rest; quick stop when that is not certain."""
    HALT = "halt"
    STOP = "stop"
    """Quick stop; stays there."""
    DISABLE = "disable"
    """Quick stop, and switch on disabled once at rest."""
    RESET = "reset"
    """Clear a fault; stays disabled."""


@dataclass(frozen=True)
class StateTransition:
    """A row of the standard's table; ``control`` is the word that commands it, if any."""

    number: int
    source: DriveState
    target: DriveState
    control: int | None


SHUTDOWN = 0x06
SWITCH_ON = 0x07
ENABLE_OPERATION = 0x0F
QUICK_STOP = 0x02
DISABLE_VOLTAGE = 0x00
FAULT_RESET = 0x80
HALT = 0x100
"""Bits of the control word 6040h for each command of CiA 402's table of commands; halt is bit 8."""

TRANSITIONS: tuple[StateTransition, ...] = (
    StateTransition(1, DriveState.NOT_READY_TO_SWITCH_ON, DriveState.SWITCH_ON_DISABLED, None),
    StateTransition(2, DriveState.SWITCH_ON_DISABLED, DriveState.READY_TO_SWITCH_ON, SHUTDOWN),
    StateTransition(3, DriveState.READY_TO_SWITCH_ON, DriveState.SWITCHED_ON, SWITCH_ON),
    StateTransition(4, DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED, ENABLE_OPERATION),
    StateTransition(5, DriveState.OPERATION_ENABLED, DriveState.SWITCHED_ON, SWITCH_ON),
    StateTransition(6, DriveState.SWITCHED_ON, DriveState.READY_TO_SWITCH_ON, SHUTDOWN),
    StateTransition(
        7, DriveState.READY_TO_SWITCH_ON, DriveState.SWITCH_ON_DISABLED, DISABLE_VOLTAGE
    ),
    StateTransition(8, DriveState.OPERATION_ENABLED, DriveState.READY_TO_SWITCH_ON, SHUTDOWN),
    StateTransition(
        9, DriveState.OPERATION_ENABLED, DriveState.SWITCH_ON_DISABLED, DISABLE_VOLTAGE
    ),
    StateTransition(10, DriveState.SWITCHED_ON, DriveState.SWITCH_ON_DISABLED, DISABLE_VOLTAGE),
    StateTransition(11, DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE, QUICK_STOP),
    StateTransition(
        12, DriveState.QUICK_STOP_ACTIVE, DriveState.SWITCH_ON_DISABLED, DISABLE_VOLTAGE
    ),
    StateTransition(14, DriveState.FAULT_REACTION_ACTIVE, DriveState.FAULT, None),
    StateTransition(15, DriveState.FAULT, DriveState.SWITCH_ON_DISABLED, FAULT_RESET),
    StateTransition(
        16, DriveState.QUICK_STOP_ACTIVE, DriveState.OPERATION_ENABLED, ENABLE_OPERATION
    ),
)
"""Transition 13, from any state into fault reaction, has no row: no word commands it."""

_STATUS: tuple[tuple[int, int, DriveState], ...] = (
    (0x4F, 0x00, DriveState.NOT_READY_TO_SWITCH_ON),
    (0x4F, 0x40, DriveState.SWITCH_ON_DISABLED),
    (0x6F, 0x21, DriveState.READY_TO_SWITCH_ON),
    (0x6F, 0x23, DriveState.SWITCHED_ON),
    (0x6F, 0x27, DriveState.OPERATION_ENABLED),
    (0x6F, 0x07, DriveState.QUICK_STOP_ACTIVE),
    (0x4F, 0x0F, DriveState.FAULT_REACTION_ACTIVE),
    (0x4F, 0x08, DriveState.FAULT),
)

_ENABLING = {
    row.source: row.control for row in TRANSITIONS if row.number in (2, 3, 4) and row.control
} | {DriveState.OPERATION_ENABLED: ENABLE_OPERATION}
_FRESH = 1
"""A status word of the SYNC before is the newest where the answer to this one is on its way."""
_RAMP_AGE = 5
"""SYNCs. A ramp survives late or lost answers as long as motion does (condition ``feedback``)."""
_STAYING = {RequestedState.RUN_DOWN: ENABLE_OPERATION, RequestedState.HALT: ENABLE_OPERATION | HALT}
_ENABLE = RequestedState.ENABLE
"""An attribute of an enum class takes 0.1 us in Python 3.11, too long for every cycle."""


def _enables(word: int) -> bool:
    return word & (FAULT_RESET | ENABLE_OPERATION) == ENABLE_OPERATION


def _said(status: int) -> DriveState:
    for mask, value, state in _STATUS:
        if status & mask == value:
            return state
    return DriveState.UNKNOWN


STATE_BITS = 0x6F
"""Bits of the status word that say the power state."""
STATES = tuple(_said(bits) for bits in range(STATE_BITS + 1))
"""The power state by these bits."""


def state_of(status: int) -> DriveState:
    """Power state that a status word 6041h says."""
    return STATES[status & STATE_BITS]


def control_word(
    state: DriveState,
    requested: RequestedState,
    *,
    previous: int = 0,
    age: int = 0,
    at_rest: bool = False,
) -> int:
    """Control word 6040h that leads from ``state`` towards ``requested``.

    Where nothing else is certain it is quick stop, which leads down from every state and, unlike
    disable voltage, never lets a moving drive coast.

    ``previous`` is the word sent last: a fault reset is an edge of bit 7, and a ramp is not taken
    up again after a quick stop, which 0Fh would revoke in a drive that stays in quick stop active
    (605Ah from 5) while an older status word still says enabled. ``age`` is the age of the status
    word in SYNCs, ``at_rest`` says whether the motor stands still.
    """
    if requested is _ENABLE and state in _ENABLING:
        return _ENABLING[state]
    fresh = age <= _FRESH
    stays = requested in _STAYING and state is DriveState.OPERATION_ENABLED and age <= _RAMP_AGE
    if stays and _enables(previous):
        return _STAYING[requested]
    if (
        fresh
        and state is DriveState.FAULT
        and requested is RequestedState.RESET
        and not previous & FAULT_RESET
    ):
        return FAULT_RESET
    leaves = requested in (RequestedState.DISABLE, RequestedState.ENABLE) and fresh and at_rest
    return DISABLE_VOLTAGE if leaves and state is DriveState.QUICK_STOP_ACTIVE else QUICK_STOP
