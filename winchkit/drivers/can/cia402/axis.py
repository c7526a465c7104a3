"""A CiA 402 axis: newest feedback in SI, and one command a cycle."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.canopen.emergency import EmergencyLog, error_text
from winchkit.drivers.can.canopen.nmt import NmtCommand, NmtState, state_text
from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.drivers.can.canopen.pdo_parameters import cob_id
from winchkit.drivers.can.cia402.command import Commander, CycleCommand
from winchkit.drivers.can.cia402.commission import Commissioned, WatchSpec, await_booted, commission
from winchkit.drivers.can.cia402.feedback import (
    AxisFeedback,
    FeedbackHealth,
    Gathering,
    check_feedback,
)
from winchkit.drivers.can.cia402.modes import (
    MODES,
    HomingState,
    TargetKind,
    change_mode,
    homing_state,
    require_mode,
    status_words,
)
from winchkit.drivers.can.cia402.motor_position import MotorPosition
from winchkit.drivers.can.cia402.profile_parameters import (
    HomingSpec,
    set_homing,
    set_profile,
    set_quick_stop,
)
from winchkit.drivers.can.cia402.sdo_stop import SdoStop
from winchkit.drivers.can.cia402.second_master import SecondMaster
from winchkit.drivers.can.cia402.state_machine import (
    POWERED,
    QUICK_STOP,
    DriveState,
    RequestedState,
    control_word,
)
from winchkit.drivers.can.host_loss.mechanism import Silence, Terms
from winchkit.drivers.can.host_loss.watch import HostWatch
from winchkit.drivers.clock import Clock
from winchkit.errors import Fault, FileError, NotPermitted, WinchkitError
from winchkit.schema.devices.device import DeviceSpec

_STALE_SYNCS, _STALE_BEATS = 5, 2
"""Feedback that is older than both of these does not show the drive's state any more."""
_LATE_REPLY = 0.05
"""Left for the reply to a single SDO request, s: a tenth of the time-out of a transfer."""
_ENABLE, _DISABLE = RequestedState.ENABLE, RequestedState.DISABLE
_new = tuple.__new__
_RAMPS = (RequestedState.RUN_DOWN, RequestedState.HALT)
_OPERATIONAL = int(NmtState.OPERATIONAL)


class Cia402Axis:
    """One drive on a CAN bus.

    ``commission``, ``switch_mode``, ``prepare_homing`` and ``set_profile`` talk SDO and may take
    a second; ``send`` and ``feedback`` are for the control loop. ``begin_cycle`` gives it the
    number and time of each SYNC. The axis outlives its bus: after ``CanBus.reopen`` it is
    commissioned again.
    """

    def __init__(
        self, bus: CanBus, node: int, device: DeviceSpec, watch: WatchSpec, clock: Clock
    ) -> None:
        """Attach to a node; nothing is sent yet. Raises FileError for an unusable device file."""
        if device.servo is None:
            raise FileError(Fault("is no servo drive; name one as `servo`", device.path))
        self.name = f"bus '{bus.name}' node {node}"
        self.servo = device.servo
        self.emergencies = EmergencyLog()
        self.drive: Commissioned | None = None
        """Confirmed set-up; None before the axis is commissioned."""
        self._enter_mode(device.servo.motion_mode)
        self._bus, self._clock, self._watch = bus, clock, watch
        self._node = SdoNode(bus, node, Path(device.path).parent / device.servo.eds)
        terms = Terms(watch.host, watch.timeout, watch.heartbeat, watch.cycle)
        self.host = HostWatch(self._node, device.servo, terms, clock, watch.hardware)
        """Host-loss mechanism of the drive; its ``silent`` ends the life signs, to stop it."""
        self.heartbeat = self.host.heartbeat
        self.position = MotorPosition(device.servo, watch)
        """Whether and where the motor angle is known; its record."""
        self._gathering: Gathering | None = None
        self._commander: Commander | None = None
        self._cycle = (0, -math.inf)
        self._boot_ups = self._beats = 0
        self._watched = False
        """Whether the drive has had a life sign of the host since it was commissioned."""
        self._previous = 0
        self._quick_stop = watch.quick_stop
        self.sdo_stop = SdoStop(bus, node)
        self.second_master = SecondMaster(
            bus, node, [pdo.number for pdo in device.servo.rpdo], watch.host
        )
        self._stop_frames: list[tuple[int, bytes]] = []
        bus.on(0x700 + node, self.heartbeat.receive)
        bus.on(0x080 + node, self.emergencies.receive)

    def commission(self) -> Commissioned:
        """Set the drive up, checked and disabled; raises NoReply, DeviceRefused, NotPermitted."""
        self._gathering = self._commander = None
        self._previous = 0
        stopping = self.sdo_stop.active
        self.sdo_stop.hold(True)
        if stopping:
            # Its last reply would be taken for that of a transfer which begins meanwhile.
            self._clock.sleep(_LATE_REPLY)
        try:
            return self._commission()
        finally:
            self.sdo_stop.hold(False)

    def _commission(self) -> Commissioned:
        self.heartbeat.forget()
        await_booted(self._node, self.servo.boot_time, self._clock, self.heartbeat)
        self.second_master.hear_further_servers(self._node)
        self.second_master.hear_further_rpdos(self._node)
        # Only a boot-up after this one takes away what is set up now.
        self._boot_ups = self.heartbeat.boot_ups
        self._beats, self._watched = self._bus.beats[self._watch.host], False
        self.position.look(self._node)
        drive = commission(self._node, self.servo, self._watch, self._clock, self.host)
        self.host.await_operational()
        if self._watch.prove:
            proof = self.host.prove(self.emergencies)
            self.emergencies.clear()
            loss = self.host.reaction(proof, drive.options, seen=self._watch.seen_stopping)
            drive = dataclasses.replace(drive, proof=proof, host_loss=loss)
        self.host.arm()
        counter = self.position.begin(drive, self._boot_ups)
        if counter.zero:
            self._require_unlimited()
        commander = Commander(self.name, drive, self._node.node, drive.mode, counter)
        gathering = self._listen(drive)
        self.drive = drive
        self._enter_mode(drive.mode)
        self._quick_stop = self._watch.quick_stop
        self._commander, self._gathering = commander, gathering
        self._stop_frames = commander.stop_frames()
        self.emergencies.in_force.clear()
        return drive

    def take_commissioning(self, *, seen_stopping: bool, stops_on_nmt: bool) -> None:
        """Take what the commissioning record says of this very drive, while it is enabled."""
        self._watch = dataclasses.replace(
            self._watch, seen_stopping=seen_stopping, stops_on_nmt=stops_on_nmt
        )
        if self.drive is not None:
            loss = self.host.reaction(self.drive.proof, self.drive.options, seen=seen_stopping)
            self.drive = dataclasses.replace(self.drive, host_loss=loss, stops_on_nmt=stops_on_nmt)

    def emergency_stop(self, *, sdo: bool) -> None:
        """Send the quick stop that was prepared at commissioning: RPDOs with 02h, SDO where asked.

        Nothing is computed and nothing is read: it works whatever else has failed. The RPDOs take
        effect at the next SYNC. Raises ConnectionLost.
        """
        self._previous = QUICK_STOP
        for identifier, data in () if self.host.withholds_rpdos else self._stop_frames:
            self._bus.withdraw(identifier)
            self._bus.send(identifier, data)
        if sdo:
            self.sdo_stop.send()

    def stop_by_nmt(self) -> None:
        """NMT stop; raises ConnectionLost."""
        self._bus.nmt(NmtCommand.STOP, self._node.node)

    @property
    def stops_on_nmt(self) -> bool:
        """Whether commissioning saw it leave operation enabled on NMT stop."""
        return False if self.drive is None else self.drive.stops_on_nmt

    @property
    def mode(self) -> str:
        """Name of its mode of operation."""
        return self._mode.name

    @property
    def nmt_text(self) -> str:
        """NMT state of its heartbeat in words."""
        state = self.heartbeat.state
        return "unknown" if state is None else state_text(state)

    @property
    def alarms(self) -> tuple[int, ...]:
        """Emergency codes that it sent and has not taken back."""
        in_force = self.emergencies.in_force
        return tuple(in_force) if in_force else ()

    @property
    def position_doubt(self) -> str:
        """Why the motor angle is not known, in words; empty where it is."""
        position = self.position
        return position.after_boot_up() if self.mapping_lost else position.doubt

    def define_position(self, angle: float) -> None:
        """Let the disabled motor have an angle (rad), by a zero that the record keeps."""
        self._disabled_drive("define its position")
        self._require_unlimited()
        self.position.define(angle)

    @property
    def position_jump(self) -> str:
        """Change of 6064h that no motion explains, in words; empty without one."""
        jump, twice = self.position.jump, self.health.late
        if jump and twice:
            jump += f" ({twice} answers came beside another one: two nodes may have this number)"
        return jump

    def fall_silent(self) -> bool:
        """End the life signs that the drive watches; returns whether SYNC is one of them."""
        self.host.silent = True
        return self.host.mechanism.silence in (Silence.SYNC, Silence.ALL)

    @property
    def objects(self) -> SdoNode:
        """Its object dictionary over SDO."""
        return self._node

    @property
    def feedback(self) -> AxisFeedback | None:
        """Feedback of the newest complete answer to a SYNC."""
        gathering = self._gathering
        return None if gathering is None else gathering.feedback

    @property
    def health(self) -> FeedbackHealth:
        """Counts of its TPDOs since it was commissioned."""
        return FeedbackHealth() if self._gathering is None else self._gathering.health

    def _enter_mode(self, name: str) -> None:
        self._mode = mode = MODES[name]
        self.moves_alone = mode.moves_alone
        """Whether it makes the motion of its mode by itself (HM, PP)."""
        self.position_mode = mode.kind is TargetKind.ANGLE
        """Whether it is moved by target positions (CSP, IP) and not by speeds."""

    @property
    def mode_kept(self) -> bool:
        """Whether the drive still shows the mode that it was given."""
        gathering = self._gathering
        if gathering is None or gathering.feedback is None:
            return True
        shown = gathering.feedback.mode
        return shown is None or shown == self._mode.number

    @property
    def operational(self) -> bool:
        """Whether its heartbeat shows the NMT state operational."""
        state = self.heartbeat.state
        return state is None or state == _OPERATIONAL

    @property
    def mapping_lost(self) -> bool:
        """Whether it has booted since it was commissioned, and lost its PDO mapping."""
        return self.heartbeat.boot_ups != self._boot_ups

    @property
    def lost_set_up(self) -> bool:
        """Whether it has to be commissioned again: it booted, or does not run its PDOs."""
        return self.mapping_lost or not self.operational or self.state is DriveState.UNKNOWN

    @property
    def state(self) -> DriveState:
        """Power state by the newest feedback; UNKNOWN once that is stale."""
        return self._certain(self.feedback)

    def _certain(self, feedback: AxisFeedback | None) -> DriveState:
        """The state that a feedback, the newest, shows."""
        if feedback is None or self.mapping_lost:
            return DriveState.UNKNOWN
        sync, now = self._cycle
        old = sync - feedback.sync > _STALE_SYNCS
        if old and now - feedback.time > _STALE_BEATS * self._watch.heartbeat:
            return DriveState.UNKNOWN
        return feedback.state

    @property
    def homing(self) -> HomingState:
        """State of the homing by the newest feedback; for the mode HM, once it was started."""
        return (
            HomingState.INTERRUPTED if self.feedback is None else homing_state(self.feedback.status)
        )

    @property
    def status_words(self) -> tuple[str, ...]:
        """The bits of its status word in words, as its mode gives them meaning."""
        return () if self.feedback is None else status_words(self.mode, self.feedback.status)

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
        return self.position.at_rest(self.feedback)

    def begin_cycle(self, sync: int, now: float) -> None:
        """Note the SYNC that is about to be sent: TPDOs that follow were sampled at it."""
        self._cycle = (sync, now)
        self.host.begin_cycle(now)
        if self._gathering is not None:
            self._gathering.begin(sync, now)

    def send(
        self,
        requested: RequestedState,
        *,
        velocity: float = 0.0,
        angle: float | None = None,
        torque: float = 0.0,
        start: bool = False,
    ) -> int:
        """Send the next control word towards ``requested`` with targets (rad/s, rad, N m).

        Returns the word. The mode says which target counts; beside it, velocity and torque are
        fed forward where 60B1h and 60B2h are mapped. Without a target angle a
        position-controlled axis holds where it is; a drive that is not enabled gets zero and its
        actual position, so that it starts from rest. To run down is to halt where the drive makes
        the motion itself (PP, HM), and to quick-stop under a torque. ``start`` starts a homing
        (HM). Nothing is enabled before the host's heartbeat runs. Raises NotPermitted for
        targets beyond the drive's range, ConnectionLost.
        """
        commander, feedback = self._commander, self.feedback
        if commander is None or feedback is None:
            return self._previous
        if requested in _RAMPS and not self._mode.can_run_down:
            requested = RequestedState.STOP
        if not self._watched and requested is _ENABLE and not self._note_life_sign():
            # The drive's watchdog arms on the first life sign that it receives.
            requested = _DISABLE
        word = control_word(
            self._certain(feedback),
            requested,
            previous=self._previous,
            age=self._cycle[0] - feedback.sync,
            at_rest=self.position.at_rest(feedback),
        )
        # What Command(...) makes, without the call of its constructor.
        command = _new(CycleCommand, (requested, velocity, angle, torque, start))
        word, frames = commander.frames(word, command, feedback)
        if not self.host.silent or not self.host.withholds_rpdos:
            for identifier, data in frames:
                self._bus.post(identifier, data)
        self._previous = word
        return word

    def switch_mode(self, mode: str) -> None:
        """Give the drive another mode, verified, while it is disabled.

        Raises NotPermitted when it is not or when it lacks the mode, FileError when the device
        file maps no target for it, NoReply, DeviceRefused; it then keeps the mode that it had.
        """
        drive = self._disabled_drive(f"change to {mode}")
        require_mode(self._node, drive.modes, mode)
        commander = Commander(self.name, drive, self._node.node, mode, self.position.counter)
        before, previous = self._commander, self._mode.name
        # From here on cyclic PDOs must carry the new mode, lest they set the old one again.
        self._commander = commander
        self._enter_mode(mode)
        self._stop_frames = commander.stop_frames()
        try:
            change_mode(self._node, mode, self._clock)
        except WinchkitError:
            self._commander = before
            self._enter_mode(previous)
            if self._commander is not None:
                self._stop_frames = self._commander.stop_frames()
            raise
        self.position.changed_mode(previous, mode)

    def prepare_homing(self, homing: HomingSpec) -> None:
        """Set a homing up and change to HM, disabled; ``send`` with ``start`` runs it."""
        drive = self._disabled_drive("prepare a homing")
        set_homing(self._node, self.servo, drive.scale, homing)
        self.switch_mode("HM")

    def permit_angle(self, angle: float) -> None:
        """Raise NotPermitted where a position mode cannot go to a motor angle (rad)."""
        if self.position_mode and self._commander is not None:
            self._commander.counts(angle)

    def set_profile(self, *, speed: float | None = None, acceleration: float | None = None) -> None:
        """Set speed (rad/s) and ramps (rad/s^2) of the profile modes; raises NotPermitted."""
        drive = self._disabled_drive("set its profile")
        set_profile(self._node, self.servo, drive.scale, speed=speed, acceleration=acceleration)

    def set_quick_stop(self, acceleration: float | None = None) -> None:
        """Set the ramp of quick stops (rad/s²), None for that of commissioning, before a motion."""
        wanted = self._watch.quick_stop if acceleration is None else acceleration
        if self.drive is None or wanted == self._quick_stop:
            return
        self._quick_stop = math.nan  # unknown where the transfer fails
        set_quick_stop(self._node, self.servo, self.drive.scale, wanted)
        self._quick_stop = wanted

    def _require_unlimited(self) -> None:
        """Raise NotPermitted where 607Dh of the drive would limit by another zero than its own."""
        if self._watch.limits.angle is not None:
            raise NotPermitted(
                f"{self.name}: the zero of its position is kept here and not in the drive, whose "
                "own length limits (607Dh) do not know it; set limits.in_drive = false"
            )

    def _note_life_sign(self) -> bool:
        """Whether the drive has had a life sign of the host since it was commissioned."""
        self._watched = self.host.begun(self._bus.beats[self._watch.host] - self._beats)
        return self._watched

    def _disabled_drive(self, what: str) -> Commissioned:
        if self.drive is None:
            raise NotPermitted(f"{self.name}: commission the drive before you {what}")
        if self.state in POWERED or not self.at_rest:
            raise NotPermitted(
                f"{self.name}: cannot {what} while the drive is {self.state} and "
                f"{'at rest' if self.at_rest else 'moving'}; stop it first"
            )
        return self.drive

    def _listen(self, drive: Commissioned) -> Gathering:
        """Receive the drive's TPDOs with a new decoder."""
        check_feedback(self.name, drive.tpdo)
        gathering = Gathering(
            drive.tpdo,
            drive.scale,
            self._watch.cycle,
            self.position.counter,
            self.position.agreement,
        )
        for codec in drive.tpdo:
            identifier = cob_id("tpdo", codec.spec.number, self._node.node)
            self._bus.on(identifier, gathering.receiver(codec))
        return gathering
