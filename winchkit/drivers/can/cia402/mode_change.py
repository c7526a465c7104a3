"""Changing the mode of operation of a drive that cannot move, and verifying it."""

from __future__ import annotations

from collections.abc import Sequence

from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.drivers.can.cia402.modes import MODES, Target, mode_named, modes_of
from winchkit.drivers.clock import Clock
from winchkit.errors import NotPermitted
from winchkit.schema.devices.servo import ServoSpec

_MODE_TIME = 0.5
"""s: a drive changes its mode within some cycles of its control; as long as an SDO request may take
(rule of thumb)."""
_POLL = 0.01
"""s: 50 looks within the time."""
_OFFSETS = (0x60B0, 0x60B1, 0x60B2)
"""Of position, velocity and torque."""


def supported_modes(node: SdoNode, servo: ServoSpec, wanted: str) -> tuple[str, ...]:
    """The modes of 6502h, else of the device file; raises NotPermitted without the wanted one.

    A drive without any mode is none: 6502h that reads 0 says nothing.
    """
    supported = node.read_if_there(0x6502)
    there: tuple[str, ...] = modes_of(supported) if supported else servo.modes
    require_mode(node, there, wanted)
    return there


def require_mode(node: SdoNode, there: Sequence[str], wanted: str) -> None:
    """Raise NotPermitted for a mode that is not among a drive's, and say whose list that is."""
    if wanted in there:
        return
    has = ", ".join(there) or "none"
    if node.read_if_there(0x6502):
        raise NotPermitted(
            f"{node.place(0x6502)}: the drive has no mode {wanted}; it has {has}; choose one of "
            "these (motion_mode in the device file)"
        )
    raise NotPermitted(
        f"{node.place(0x6502)} does not say which modes the drive has, and its device file does "
        f"not list {wanted}: modes = {has}; add it there if the manual has it"
    )


def rest_targets(node: SdoNode, mode: str) -> None:
    """Zero speed or torque, or the actual position, before the mode can act on it.

    Offsets that another master has left would be added to every target: they become zero.
    """
    row = MODES[mode]
    if row.target is not None:
        at_rest = node.read(0x6064) if row.kind is Target.ANGLE else 0
        node.write(*row.target, at_rest)
    for index in _OFFSETS:
        if node.read_if_there(index):
            node.write_verified(index, 0, 0)


def change_mode(node: SdoNode, mode: str, clock: Clock) -> None:
    """Give a disabled drive a mode and wait until 6061h shows it; raises NotPermitted."""
    rest_targets(node, mode)
    number = MODES[mode].number
    node.write(0x6060, 0, number)
    deadline = clock.now() + _MODE_TIME
    while (shown := node.read(0x6061)) != number:
        if clock.now() > deadline:
            raise NotPermitted(
                f"{node.place(0x6061)} shows {mode_named(shown)} {_MODE_TIME:g} s after {mode} "
                f"({number}) was asked for; the drive does not take this mode now"
            )
        clock.sleep(_POLL)
