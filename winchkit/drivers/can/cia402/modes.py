"""Modes of operation of CiA 402-2 as a table: numbers, targets, and what their own bits mean."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property

from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.drivers.can.canopen.pdo import Key
from winchkit.drivers.can.cia402.state_machine import StatusBit
from winchkit.drivers.clock import Clock
from winchkit.errors import NotPermitted
from winchkit.schema.devices.servo import ServoSpec

START = 1 << 4
"""Control bit 4: new set-point in PP, start in HM, follow in IP."""
AT_ONCE = 1 << 5
"""Control bit 5 in PP: do not finish the move under way first."""

_REACHED, _LIMIT = StatusBit.TARGET_REACHED, StatusBit.INTERNAL_LIMIT
_BIT_12, _BIT_13 = 1 << 12, 1 << 13


class TargetKind(Enum):
    """What kind of target a mode follows."""

    ANGLE = "angle"
    VELOCITY = "velocity"
    TORQUE = "torque"
    NONE = "none"


@dataclass(frozen=True)
class OperationMode:
    """A row of the table."""

    name: str
    number: int
    """Of 6060h and 6061h."""
    bit: int
    """Of 6502h."""
    kind: TargetKind
    target: Key | None
    """The object that its target is written to."""
    cyclic: bool
    """Whether it takes a target every SYNC and interpolates by 60C2h."""
    bits: Mapping[int, str]
    """Status bits 10, 12 and 13 in words, by mask."""

    @cached_property
    def moves_alone(self) -> bool:
        """Whether the drive goes on to a goal of its own, whatever the host sends next."""
        return self.name in ("PP", "HM")

    @cached_property
    def can_run_down(self) -> bool:
        """Whether it can be ramped to rest while it stays enabled; no torque holds a load."""
        return self.kind is not TargetKind.TORQUE


def _row(
    name: str, number: int, kind: TargetKind, target: Key | None, *bits: str, cyclic: bool = False
) -> OperationMode:
    masks = (_REACHED, _BIT_12, _BIT_13)
    words = {int(mask): word for mask, word in zip(masks, bits, strict=True) if word}
    return OperationMode(name, number, number - 1, kind, target, cyclic, words)


_FOLLOWS, _ERROR = "follows the command", "following error"
_ROWS = (
    _row(
        "PP", 1, TargetKind.ANGLE, (0x607A, 0), "target reached", "set-point acknowledged", _ERROR
    ),
    _row("PV", 3, TargetKind.VELOCITY, (0x60FF, 0), "target reached", "speed zero", "slipping"),
    _row("PT", 4, TargetKind.TORQUE, (0x6071, 0), "target reached", "", ""),
    _row("HM", 6, TargetKind.NONE, None, "target reached", "homing attained", "homing error"),
    _row("IP", 7, TargetKind.ANGLE, (0x60C1, 1), "target reached", "following", "", cyclic=True),
    _row("CSP", 8, TargetKind.ANGLE, (0x607A, 0), "", _FOLLOWS, _ERROR, cyclic=True),
    _row("CSV", 9, TargetKind.VELOCITY, (0x60FF, 0), "", _FOLLOWS, "", cyclic=True),
    _row("CST", 10, TargetKind.TORQUE, (0x6071, 0), "", _FOLLOWS, "", cyclic=True),
)

MODES: dict[str, OperationMode] = {row.name: row for row in _ROWS}
TARGETS: tuple[Key, ...] = tuple(dict.fromkeys(row.target for row in _ROWS if row.target))
"""Every object that some mode takes its target from."""


def modes_of(supported: int) -> tuple[str, ...]:
    """Names of the modes in 6502h."""
    return tuple(row.name for row in _ROWS if supported & 1 << row.bit)


def mode_named(number: int) -> str:
    """How messages call a value of 6061h."""
    return next((row.name for row in _ROWS if row.number == number), f"mode {number}")


def status_words(mode: str, status: int) -> tuple[str, ...]:
    """Bits of a status word beside the state, in words; without a mode those that all share."""
    common = {int(StatusBit.WARNING): "warning", int(_LIMIT): "internal limit active"}
    meaning = common | dict(MODES[mode].bits if mode in MODES else {})
    return tuple(word for mask, word in meaning.items() if status & mask)


class HomingState(Enum):
    """State of a homing, by bits 13, 12 and 10 of the statusword."""

    RUNNING = "running"
    INTERRUPTED = "interrupted or not started"
    ATTAINED = "attained, still moving"
    DONE = "done"
    FAILED_MOVING = "failed, still moving"
    FAILED = "failed"

    @property
    def over(self) -> bool:
        """Whether it has ended, with or without success."""
        return self in (HomingState.DONE, HomingState.FAILED)


_HOMING = {
    (False, False, False): HomingState.RUNNING,
    (False, False, True): HomingState.INTERRUPTED,
    (False, True, False): HomingState.ATTAINED,
    (False, True, True): HomingState.DONE,
    (True, False, False): HomingState.FAILED_MOVING,
    (True, False, True): HomingState.FAILED,
}


def homing_state(status: int) -> HomingState:
    """State of a homing in the mode HM; a reserved pattern of the bits counts as failed."""
    bits = (bool(status & _BIT_13), bool(status & _BIT_12), bool(status & _REACHED))
    return _HOMING.get(bits, HomingState.FAILED)


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
        at_rest = node.read(0x6064) if row.kind is TargetKind.ANGLE else 0
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
