"""A CiA 402 axis: newest feedback in SI, and one command a cycle."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from pathlib import Path

from winchkit.drivers.can.bus import CanBus, Handler
from winchkit.drivers.can.cia402 import State, Wish, control_word, state_of
from winchkit.drivers.can.commission import MODES, Commissioned, WatchSpec, commission
from winchkit.drivers.can.emergency import Emergency, error_text, parse_emergency
from winchkit.drivers.can.heartbeat import HeartbeatWatch, NmtState
from winchkit.drivers.can.node import SdoNode
from winchkit.drivers.can.pdo import PdoCodec
from winchkit.drivers.can.pdo_setup import cob_id
from winchkit.drivers.clock import Clock
from winchkit.errors import Fault, FileError, NotPermitted
from winchkit.schema.device import DeviceSpec

__all__ = ["AxisFeedback", "Cia402Axis"]

_CONTROL, _TARGET_POSITION, _TARGET_VELOCITY = (0x6040, 0), (0x607A, 0), (0x60FF, 0)
_STATUS, _POSITION, _VELOCITY, _TORQUE = (0x6041, 0), (0x6064, 0), (0x606C, 0), (0x6077, 0)
_MODE, _ERROR = (0x6061, 0), (0x603F, 0)
_COMMANDS = {_CONTROL, _TARGET_POSITION, _TARGET_VELOCITY}
_POLL = 0.005
_REST = 0.05
"""Below this speed of the motor, rad/s, it counts as standing still."""


@dataclass(frozen=True, slots=True)
class AxisFeedback:
    """What a drive said at one SYNC; SI at the motor shaft."""

    time: float
    """Estimate of the moment of sampling, on the bench's clock, s: the SYNC reaches the drive
    between its sending and the arrival of the first answer."""
    sync: int
    """Number of that SYNC."""
    state: State
    status: int
    angle: float
    """rad."""
    velocity: float
    """rad/s; NaN where the drive does not send it."""
    torque: float
    """N m; NaN where the drive does not send it."""
    mode: int | None = None
    """As 6061h shows it; None where the drive does not send it."""
    error_code: int = 0


class Cia402Axis:
    """One drive on a CAN bus.

    ``commission`` talks SDO and may take a second; ``send`` and ``feedback`` are for the control
    loop. ``begin_cycle`` tells it the number and time of each SYNC.
    """

    def __init__(
        self, bus: CanBus, node: int, device: DeviceSpec, watch: WatchSpec, clock: Clock
    ) -> None:
        """Attach to a node; nothing is sent yet. Raises FileError for an unusable device file."""
        if device.servo is None:
            raise FileError(Fault("is no servo drive; name one as `servo`", device.path))
        self.name = f"bus '{bus.name}' node {node}"
        self.servo = device.servo
        self.heartbeat = HeartbeatWatch(watch.timeout)
        self.emergencies: deque[Emergency] = deque(maxlen=64)
        self.feedback: AxisFeedback | None = None
        self.short_frames = 0
        self._bus, self._clock, self._watch = bus, clock, watch
        self._node = SdoNode(bus, node, Path(device.path).parent / device.servo.eds)
        self._drive: Commissioned | None = None
        self._commands: tuple[tuple[int, PdoCodec], ...] = ()
        self._cycle = self._answered = (0, -math.inf)
        self._latest: dict[int, tuple[int, tuple[int, ...]]] = {}
        self._previous = 0
        bus.on(0x700 + node, self.heartbeat.receive)
        bus.on(0x080 + node, self._on_emergency)

    def commission(self) -> Commissioned:
        """Set the drive up, checked and disabled; raises NoReply, DeviceRefused, NotPermitted."""
        self.feedback = None
        self._latest.clear()
        self.heartbeat.last = self.heartbeat.state = None
        drive = commission(self._node, self.servo, self._watch, self._clock)
        self._check_mapping(drive)
        target = _TARGET_POSITION if self.position_mode else _TARGET_VELOCITY
        self._commands = tuple(
            (cob_id("rpdo", codec.spec.number, self._node.node), codec)
            for codec in drive.rpdo
            if _CONTROL in codec.position or target in codec.position
        )
        self._drive = drive
        for codec in drive.tpdo:
            identifier = cob_id("tpdo", codec.spec.number, self._node.node)
            self._bus.on(identifier, self._receiver(codec))
        self._await_operational()
        return drive

    def disarm(self) -> None:
        """Let the drive, at rest, stop watching the host's heartbeat; raises ConnectionLost."""
        self._node.write(0x1016, 1, 0)

    @property
    def position_mode(self) -> bool:
        """Whether it is moved by target positions (CSP) and not by speeds."""
        return self.servo.motion_mode == "CSP"

    @property
    def mode_kept(self) -> bool:
        """Whether the drive still shows the mode that it was given."""
        shown = self.feedback.mode if self.feedback else None
        return shown is None or shown == MODES[self.servo.motion_mode][0]

    @property
    def operational(self) -> bool:
        """Whether its heartbeat says that its PDOs run."""
        return self.heartbeat.state in (None, NmtState.OPERATIONAL)

    @property
    def fault_text(self) -> str:
        """Its error code and last emergency in words."""
        code = self.feedback.error_code if self.feedback else 0
        words = f"error {code:04X}h {error_text(code)}" if code else "no error code"
        last = self.emergencies[-1] if self.emergencies else None
        return f"{words}; {last}" if last is not None and last.code != code else words

    @property
    def at_rest(self) -> bool:
        """Whether the newest feedback says that the motor stands still."""
        return self.feedback is not None and abs(self.feedback.velocity) <= _REST

    def begin_cycle(self, sync: int, now: float) -> None:
        """Note the SYNC that is about to be sent: TPDOs that follow were sampled at it."""
        self._cycle = (sync, now)

    def send(self, wish: Wish, *, velocity: float = 0.0, angle: float | None = None) -> int:
        """Send the next control word towards ``wish`` with a target (rad/s or rad).

        Returns the word. Without a target angle a position-controlled axis holds where it is;
        a drive that is not enabled gets zero and its actual position, so that it starts from rest.
        """
        drive, feedback = self._drive, self.feedback
        if drive is None or feedback is None:
            return self._previous
        word = control_word(
            feedback.state,
            wish,
            previous=self._previous,
            fresh=feedback.sync >= self._cycle[0] - 1,
            at_rest=self.at_rest,
        )
        moves = feedback.state is State.OPERATION_ENABLED and wish in (Wish.ENABLE, Wish.RUN_DOWN)
        values = {
            _CONTROL: word,
            _TARGET_VELOCITY: drive.scale.velocity_counts(velocity if moves else 0.0),
            _TARGET_POSITION: drive.scale.angle_counts(
                angle if moves and angle is not None else feedback.angle
            ),
        }
        for identifier, codec in self._commands:
            self._bus.send(identifier, codec.encode([values[key] for key in codec.position]))
        self._previous = word
        return word

    def _await_operational(self) -> None:
        """Wait for the heartbeat that confirms the start; also proves that it beats at all."""
        deadline = self._clock.now() + self._watch.timeout
        while self.heartbeat.state != NmtState.OPERATIONAL:
            if self._clock.now() > deadline:
                raise NotPermitted(
                    f"{self.name}: no heartbeat says operational within "
                    f"{self._watch.timeout:g} s of the start; check 1017h and the drive's errors"
                )
            self._clock.sleep(_POLL)

    def _check_mapping(self, drive: Commissioned) -> None:
        """Refuse a device file whose PDOs lack what motion needs or map what nobody fills."""
        mapped = {key for codec in drive.rpdo for key in codec.position}
        seen = {key for codec in drive.tpdo for key in codec.position}
        target = _TARGET_POSITION if self.position_mode else _TARGET_VELOCITY
        lacking = {_CONTROL, target} - mapped | ({_STATUS, _POSITION, _VELOCITY} - seen)
        for key, what in [(key, "lacks") for key in lacking] + [
            (key, "cannot fill") for key in mapped - _COMMANDS
        ]:
            raise FileError(Fault(f"{self.name}: its PDO mapping {what} {key[0]:04X}h"))

    def _on_emergency(self, data: bytes, now: float) -> None:
        emergency = parse_emergency(data, now)
        if emergency is None:
            self.short_frames += 1
        else:
            self.emergencies.append(emergency)

    def _receiver(self, codec: PdoCodec) -> Handler:
        number = codec.spec.number

        def receive(data: bytes, now: float) -> None:
            values = codec.decode(data)
            if values is None:
                self.short_frames += 1
                return
            sync, sent = self._cycle
            if self._answered[0] != sync:
                late = now - sent
                self._answered = (sync, sent + late / 2 if late < self._watch.cycle else sent)
            self._latest[number] = (sync, values)
            self._publish()

        return receive

    def _publish(self) -> None:
        """Make a snapshot once every TPDO of this SYNC is there, so that none is torn."""
        drive = self._drive
        sync, time = self._answered
        if drive is None or len(self._latest) < len(drive.tpdo):
            return
        values: dict[tuple[int, int], int] = {}
        for codec in drive.tpdo:
            stamp, numbers = self._latest[codec.spec.number]
            if stamp != sync:
                return
            values.update(zip(codec.position, numbers, strict=True))
        scale = drive.scale
        self.feedback = AxisFeedback(
            time=time,
            sync=sync,
            state=state_of(values[_STATUS]),
            status=values[_STATUS],
            angle=values[_POSITION] * scale.angle,
            velocity=values[_VELOCITY] * scale.velocity,
            torque=values[_TORQUE] * scale.torque if _TORQUE in values else math.nan,
            mode=values.get(_MODE),
            error_code=values.get(_ERROR, 0),
        )
