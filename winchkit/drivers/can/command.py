"""One cycle's command to a drive: targets in its own counts, packed into its RPDOs."""

from __future__ import annotations

from dataclasses import dataclass

from winchkit.drivers.can.cia402 import ENABLE_OPERATION, HALT, State, Wish
from winchkit.drivers.can.commission import Commissioned
from winchkit.drivers.can.feedback import AxisFeedback
from winchkit.drivers.can.modes import MODES, START, TARGETS, Target
from winchkit.drivers.can.pdo_setup import cob_id
from winchkit.drivers.can.set_point import SetPoint
from winchkit.errors import Fault, FileError

__all__ = ["Command", "Commander"]

Key = tuple[int, int]

_CONTROL, _MODE = (0x6040, 0), (0x6060, 0)
_VELOCITY_OFFSET, _TORQUE_OFFSET = (0x60B1, 0), (0x60B2, 0)
_ALWAYS = {_CONTROL, _MODE, _VELOCITY_OFFSET, _TORQUE_OFFSET}
_MOVES = (Wish.ENABLE, Wish.RUN_DOWN)


@dataclass(frozen=True, slots=True)
class Command:
    """What is asked of the drive in a cycle; SI at the motor shaft."""

    wish: Wish
    velocity: float = 0.0
    """rad/s."""
    angle: float | None = None
    """rad; None holds the axis where it is."""
    torque: float = 0.0
    """N m."""
    start: bool = False
    """Start a homing."""


class Commander:
    """Makes frames of commands, for one drive in one mode."""

    def __init__(self, name: str, drive: Commissioned, node: int, mode: str) -> None:
        """Raise FileError where the device file maps too little, or what nobody fills."""
        self._drive, self._mode = drive, MODES[mode]
        self._set_point = SetPoint()
        target = self._mode.target
        _check(name, drive, mode, target)
        live = _ALWAYS if target is None else _ALWAYS | {target}
        self._codecs = tuple(
            (cob_id("rpdo", codec.spec.number, node), codec, tuple(codec.position))
            for codec in drive.rpdo
            if live & codec.position.keys()
        )

    def frames(
        self, word: int, command: Command, feedback: AxisFeedback
    ) -> tuple[int, list[tuple[int, bytes]]]:
        """The control word with the bits of the mode, and the frames to send.

        ``word`` is what the state machine asks for; only one that keeps the drive enabled gets
        bits and targets, any other goes with zero and the actual position. Raises NotPermitted
        for targets beyond the drive's range.
        """
        scale = self._drive.scale
        enabled = feedback.state is State.OPERATION_ENABLED
        moves = enabled and word == ENABLE_OPERATION and command.wish in _MOVES
        bits, angle = self._aim(command, feedback, moves)
        if moves and command.wish is Wish.RUN_DOWN and self._mode.moves_alone:
            bits = HALT
        values: dict[Key, int] = {
            _CONTROL: word | bits,
            _MODE: self._mode.number,
            (0x607A, 0): angle,
            (0x60C1, 1): angle,
            (0x60FF, 0): scale.velocity_counts(command.velocity) if moves else 0,
            **self._offsets(command, moves),
        }
        return word | bits, [
            (identifier, codec.encode([values[key] for key in keys]))
            for identifier, codec, keys in self._codecs
        ]

    def _aim(self, command: Command, feedback: AxisFeedback, moves: bool) -> tuple[int, int]:
        """The bits of the mode and the target position: the actual one where nothing is asked."""
        scale = self._drive.scale
        actual = scale.angle_counts(feedback.angle)
        if not moves:
            self._set_point.reset(actual)
            return 0, actual
        wanted = None if command.angle is None else scale.angle_counts(command.angle)
        if self._mode.name == "PP":
            return self._set_point.step(wanted, feedback.status)
        return self._start_bit(command), actual if wanted is None else wanted

    def _start_bit(self, command: Command) -> int:
        """Bit 4 in modes without a handshake: follow (IP), start a homing (HM)."""
        name = self._mode.name
        return START if name == "IP" or (name == "HM" and command.start) else 0

    def _offsets(self, command: Command, moves: bool) -> dict[Key, int]:
        """Torque as the target of torque modes, torque and velocity fed forward in others."""
        scale, kind = self._drive.scale, self._mode.kind
        torque = scale.torque_counts(command.torque) if moves else 0
        feeds = moves and kind is Target.ANGLE
        return {
            (0x6071, 0): torque if kind is Target.TORQUE else 0,
            _TORQUE_OFFSET: 0 if kind is Target.TORQUE else torque,
            _VELOCITY_OFFSET: scale.velocity_counts(command.velocity) if feeds else 0,
        }


def _check(name: str, drive: Commissioned, mode: str, target: Key | None) -> None:
    mapped = {key for codec in drive.rpdo for key in codec.position}
    needed = {_CONTROL} if target is None else {_CONTROL, target}
    faults = [f"lacks {_text(key)}, which {mode} needs" for key in sorted(needed - mapped)]
    known = _ALWAYS.union(TARGETS)
    faults += [f"maps {_text(key)}, which nothing fills" for key in sorted(mapped - known)]
    if faults:
        raise FileError([Fault(f"{name}: its RPDO mapping {fault}") for fault in faults])


def _text(key: Key) -> str:
    return f"{key[0]:04X}h:{key[1]}" if key[1] else f"{key[0]:04X}h"
