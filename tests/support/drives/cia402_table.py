"""The transitions of CiA 402-2 by the bit patterns of its commands, typed from the standard."""

from __future__ import annotations

from winchkit.drivers.can.cia402.state_machine import DriveState, RequestedState

STOPS = (
    RequestedState.RUN_DOWN,
    RequestedState.HALT,
    RequestedState.STOP,
    RequestedState.DISABLE,
    RequestedState.RESET,
)
"""Wishes that must never energise a drive."""


def transition(state: DriveState, previous: int, word: int) -> int | None:
    """What the standard's command patterns (bits 7, 3 to 0) make of a word; 3 stands for 3 + 4."""
    if state is DriveState.FAULT:
        return 15 if word & 0x80 and not previous & 0x80 else None
    if word & 0x80:
        return None
    disable_voltage, quick_stop = not word & 2, word & 6 == 2
    shutdown = word & 7 == 6
    switch_on, enable = word & 15 == 7, word & 15 == 15
    table = {
        DriveState.SWITCH_ON_DISABLED: [(shutdown, 2)],
        DriveState.READY_TO_SWITCH_ON: [
            (switch_on or enable, 3),
            (disable_voltage or quick_stop, 7),
        ],
        DriveState.SWITCHED_ON: [(enable, 4), (shutdown, 6), (disable_voltage or quick_stop, 10)],
        DriveState.OPERATION_ENABLED: [
            (switch_on, 5),
            (shutdown, 8),
            (disable_voltage, 9),
            (quick_stop, 11),
        ],
        DriveState.QUICK_STOP_ACTIVE: [(disable_voltage, 12), (enable, 16)],
    }
    return next((number for applies, number in table.get(state, []) if applies), None)
