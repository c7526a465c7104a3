"""Command of one cycle to a drive: targets in its counts, packed into its RPDOs."""

from __future__ import annotations

import struct
from enum import Enum
from itertools import accumulate, islice
from typing import NamedTuple

from winchkit.drivers.can.canopen.node import object_name
from winchkit.drivers.can.canopen.pdo import Key
from winchkit.drivers.can.canopen.pdo_parameters import cob_id
from winchkit.drivers.can.cia402.commission import Commissioned
from winchkit.drivers.can.cia402.feedback import AxisFeedback, counter_range
from winchkit.drivers.can.cia402.modes import AT_ONCE, MODES, START, TARGETS, TargetKind
from winchkit.drivers.can.cia402.position_counter import PositionCounter
from winchkit.drivers.can.cia402.state_machine import (
    ENABLE_OPERATION,
    HALT,
    QUICK_STOP,
    DriveState,
    RequestedState,
)
from winchkit.errors import Fault, FileError, NotPermitted

_ACKNOWLEDGED = 1 << 12


class _Handshake(Enum):
    IDLE = 0
    PLACED = 1
    RAISED = 2


class SetPoint:
    """Set-point handshake of profile position mode: each target by an acknowledged edge of bit 4.

    The target stands on the bus a cycle before bit 4 rises, and until that is acknowledged: the
    two may travel in different PDOs, and no drive may take an edge with the target before.
    """

    def __init__(self) -> None:
        self._offered = 0
        self._step = _Handshake.IDLE

    def reset(self, actual: int) -> None:
        """The axis is not enabled: it holds its place until a target differs from it."""
        self._offered, self._step = actual, _Handshake.IDLE

    def step(self, target: int | None, status: int) -> tuple[int, int]:
        """Bits for the control word and the target to send (counts); None asks for no move."""
        acknowledged = bool(status & _ACKNOWLEDGED)
        if self._step is _Handshake.PLACED:
            self._step = _Handshake.RAISED
        elif self._step is _Handshake.RAISED:
            self._step = _Handshake.IDLE if acknowledged else _Handshake.RAISED
        elif target is not None and target != self._offered and not acknowledged:
            self._offered, self._step = target, _Handshake.PLACED
        return (START | AT_ONCE if self._step is _Handshake.RAISED else 0), self._offered


_CONTROL, _MODE = (0x6040, 0), (0x6060, 0)
_VELOCITY_OFFSET, _TORQUE_OFFSET = (0x60B1, 0), (0x60B2, 0)
_ALWAYS = {_CONTROL, _MODE, _VELOCITY_OFFSET, _TORQUE_OFFSET}
_ENABLED, _RUN_DOWN = DriveState.OPERATION_ENABLED, RequestedState.RUN_DOWN
_MOVES = (RequestedState.ENABLE, _RUN_DOWN)


class CycleCommand(NamedTuple):
    """Requested state and targets of one cycle; SI at the motor shaft."""

    requested: RequestedState
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

    def __init__(
        self,
        name: str,
        drive: Commissioned,
        node: int,
        mode: str,
        counter: PositionCounter | None = None,
    ) -> None:
        """Raise FileError where the device file maps too little, or an object without a source."""
        self._name, self._drive, self._mode = name, drive, MODES[mode]
        self.counter = counter or PositionCounter(*counter_range(drive.tpdo))
        self._by_angle = self._mode.kind is TargetKind.ANGLE
        self._homes = mode == "HM"
        self._set_point = SetPoint() if mode == "PP" else None
        target = self._mode.target
        _check(name, drive, mode, target)
        live = _ALWAYS if target is None else _ALWAYS | {target}
        self._codecs = tuple(
            (cob_id("rpdo", codec.spec.number, node), codec)
            for codec in drive.rpdo
            if live & codec.position.keys()
        )
        self._objects = [key for _, codec in self._codecs for key in codec.position]
        """Of all RPDOs in their order; the values of a cycle stand in the same order."""
        self._layout = struct.Struct("<" + "".join(codec.layout for _, codec in self._codecs))
        """Of all RPDOs, which are packed at once."""
        ends = list(accumulate(codec.size for _, codec in self._codecs))
        self._parts = tuple(
            (identifier, slice(end - codec.size, end))
            for (identifier, codec), end in zip(self._codecs, ends, strict=True)
        )
        """Identifier of each RPDO, and its bytes among those of all."""
        self._zeros = [self._mode.number if key == _MODE else 0 for key in self._objects]
        kind, feeds = self._mode.kind, (_VELOCITY_OFFSET,)
        self._controls = self._places(_CONTROL)
        self._angles = self._places((0x607A, 0), (0x60C1, 1))
        self._speeds = self._places((0x60FF, 0), *(feeds if kind is TargetKind.ANGLE else ()))
        self._torques = self._places((0x6071, 0) if kind is TargetKind.TORQUE else _TORQUE_OFFSET)

    def frames(
        self, word: int, command: CycleCommand, feedback: AxisFeedback
    ) -> tuple[int, list[tuple[int, bytes]]]:
        """The control word with the bits of the mode, and the frames to send.

        ``word`` is what the state machine asks for; only one that keeps the drive enabled gets
        bits and targets, any other goes with zero and the actual position. Raises NotPermitted
        for targets beyond the drive's range.
        """
        requested, velocity, angle, torque, start = command
        moves = word == ENABLE_OPERATION and feedback.state is _ENABLED and requested in _MOVES
        actual = feedback.shown
        if actual is None:
            actual = self._drive.scale.angle_counts(feedback.angle)
        bits, aim = 0, actual
        if moves and self._by_angle:
            bits, aim = self._aim(angle, feedback, actual)
        elif self._set_point is not None:
            self._set_point.reset(actual)
        elif moves and start and self._homes:
            bits = START
        if moves and requested is _RUN_DOWN and self._mode.moves_alone:
            bits = HALT
        word |= bits
        values = self._zeros.copy()
        for place in self._controls:
            values[place] = word
        for place in self._angles:
            values[place] = aim
        if moves and velocity:
            for place in self._speeds:
                values[place] = self._drive.scale.velocity_counts(velocity)
        if moves and torque:
            for place in self._torques:
                values[place] = self._drive.scale.torque_counts(torque)
        return word, self._packed(values)

    def stop_frames(self) -> list[tuple[int, bytes]]:
        """Frames of a quick stop that need no feedback: 02h, the mode, and zero targets."""
        values = self._zeros.copy()
        for place in self._controls:
            values[place] = QUICK_STOP
        frames = zip(self._packed(values), self._codecs, strict=True)
        return [frame for frame, (_, codec) in frames if _CONTROL in codec.position]

    def _places(self, *keys: Key) -> tuple[int, ...]:
        """Where the values of these objects stand, as far as an RPDO carries them."""
        return tuple(place for place, key in enumerate(self._objects) if key in keys)

    def _packed(self, values: list[int]) -> list[tuple[int, bytes]]:
        """The RPDOs with these values."""
        try:
            data = self._layout.pack(*values)
        except struct.error:
            raise NotPermitted(self._beyond(values)) from None
        return [(identifier, data[part]) for identifier, part in self._parts]

    def _beyond(self, values: list[int]) -> str:
        """Which RPDO a target does not fit into, in words."""
        left = iter(values)
        for _, codec in self._codecs:
            own = list(islice(left, len(codec.objects)))
            try:
                codec.encode(own)
            except struct.error:
                said = zip(codec.position, own, strict=True)
                words = ", ".join(f"{object_name(*key)} = {value}" for key, value in said)
                return (
                    f"{self._name}: a target does not fit into RPDO {codec.spec.number} ({words}); "
                    "it is beyond the drive's range"
                )
        raise AssertionError("what fits into each RPDO fits into all")

    def _aim(self, angle: float | None, feedback: AxisFeedback, actual: int) -> tuple[int, int]:
        """The bits of the mode and the target position: the actual one where nothing is asked."""
        wanted = None if angle is None else self.counts(angle)
        if self._set_point is not None:
            return self._set_point.step(wanted, feedback.status)
        # IP has no handshake: bit 4 is to follow.
        return START if self._mode.name == "IP" else 0, actual if wanted is None else wanted

    def counts(self, angle: float) -> int:
        """Target position (607Ah) for an angle; raises NotPermitted beyond the counter's end."""
        return self.counter.target(self._drive.scale.unwrapped_counts(angle), self._name)


def _check(name: str, drive: Commissioned, mode: str, target: Key | None) -> None:
    mapped = {key for codec in drive.rpdo for key in codec.position}
    needed = {_CONTROL} if target is None else {_CONTROL, target}
    faults = [f"lacks {object_name(*key)}, which {mode} needs" for key in sorted(needed - mapped)]
    known = _ALWAYS.union(TARGETS)
    faults += [f"maps {object_name(*key)}, which nothing fills" for key in sorted(mapped - known)]
    if faults:
        raise FileError([Fault(f"{name}: its RPDO mapping {fault}") for fault in faults])
