"""A simulated CiA 402 servo drive: an independent device on a CAN bus that drives a plant."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from winchkit.errors import UsageError, suggest
from winchkit.schema.devices.servo import QuirkSpec, ServoSpec
from winchkit.sim.drive.actions import Actions
from winchkit.sim.drive.axis import DriveAxis, StatusBits
from winchkit.sim.drive.homing import Switches
from winchkit.sim.drive.modes import Mode, check_objects, modes_of, supported
from winchkit.sim.drive.motion import DriveMotion
from winchkit.sim.drive.nmt import NMT_COMMANDS, Heartbeats, NodeState, emergency_frame
from winchkit.sim.drive.object_dictionary import ObjectDictionary
from winchkit.sim.drive.pdo import Pdos
from winchkit.sim.drive.power import PowerCommand, PowerStage, PowerState
from winchkit.sim.drive.sdo import SdoServer
from winchkit.sim.drive.settings import Settings
from winchkit.sim.drive.shaft import HoldingBrake, Shaft


@dataclass(frozen=True)
class FaultKind:
    """A fault that the drive detects: its error code, and whether a ramp is still possible."""

    code: int
    cuts: bool = False
    """The power is removed at once, independent of 605Eh."""


FAULTS: dict[str, FaultKind] = {
    "over-current": FaultKind(0x2310, cuts=True),
    "over-voltage": FaultKind(0x3210),
    "under-voltage": FaultKind(0x3220),
    "over-temperature": FaultKind(0x4310),
    "torque off": FaultKind(0x5441, cuts=True),
    "encoder": FaultKind(0x7305, cuts=True),
    "following error": FaultKind(0x8611),
}
"""Fault kinds that the drive reports by an error code of CiA 402."""

CONDITIONS = {
    "reboot": "restarts as after power-on",
    "map lost": "loses its PDO mapping without a restart",
    "host lost": "detects a loss of the host's heartbeat, until the next one",
    "heartbeat stop": "sends no heartbeat",
    "tpdo stop": "sends no PDO",
    "slow sdo": "answers every SDO late",
    "sdo abort": "answers every SDO with an abort",
    "emergency storm": "sends an emergency message with every tick",
    "enable input open": "has no torque and cannot be enabled, as with STO",
    "silence": "neither receives nor sends frames, as with a cut cable",
    "recover": "ends the lasting faults",
}
"""Fault kinds without an error code."""


def known(kind: str) -> str:
    """Check the name of a fault kind; raises UsageError with the known names."""
    names = [*FAULTS, *CONDITIONS]
    if kind not in names:
        raise UsageError(
            f"a simulated drive has no fault '{kind}'; use one of {', '.join(names)}"
            + suggest(kind, names)
        )
    return kind


_SLOW = 0.3
"""Delay of a slow SDO answer, s."""
_STORM_PERIOD = 1e-3
"""s: 1000 EMCY messages a second, an eighth of the bus time at 1 Mbit/s."""
_STORM_CODE = 0x8120
"""CAN error passive."""


class FrameSender:
    """Sends frames at once, late, or not at all; a storm calls ``emergency`` every millisecond."""

    def __init__(
        self, send: Callable[[int, bytes], None], emergency: Callable[[int], None]
    ) -> None:
        self._send, self._emergency = send, emergency
        self._late: deque[tuple[float, int, bytes]] = deque()
        self._storm_due = 0.0
        self.cut = False
        """Whether the cable is cut."""
        self.slow_sdo = False
        self.storm = False

    def recover(self) -> None:
        """End all lasting disturbances."""
        self.cut = self.slow_sdo = self.storm = False

    def send(self, identifier: int, data: bytes) -> None:
        """Send a frame now."""
        if not self.cut:
            self._send(identifier, data)

    def answer(self, identifier: int, data: bytes, now: float) -> None:
        """Send an answer to an SDO request."""
        if self.slow_sdo:
            self._late.append((now + _SLOW, identifier, data))
        else:
            self.send(identifier, data)

    def tick(self, now: float) -> None:
        """Send frames that are due."""
        while self._late and self._late[0][0] <= now:
            _, identifier, data = self._late.popleft()
            self.send(identifier, data)
        if self.storm and now >= self._storm_due:
            self._storm_due = now + _STORM_PERIOD
            self._emergency(_STORM_CODE)


_BOOT_SHARE = 0.8
"""Default boot time as a share of the longest one that the device file declares."""
_HEARTBEAT_LOST = FaultKind(0x8130)
_PDO_TOO_SHORT = 0x8210
"""EMCY error code of CiA 301: PDO not processed due to length error."""
_COMMUNICATION = range(0x1000, 0x2000)


class SimDrive:
    """One drive; its time is that of the calls.

    Frames enter by :meth:`receive`, time by :meth:`tick`; both take the time (s) of one steady
    clock and are called from one thread.

    ``send``: sends a frame, given its identifier and data. ``smoothing``: length of the set-point
    filter in CSV, CSP and IP, s. ``tolerance``: time by which the motion may be behind at a tick,
    s. ``longest_step``: time between two set-points of the motion, s. ``now``: time at the start,
    s. Raises FileError where the object dictionary lacks objects of the declared modes.
    """

    def __init__(
        self,
        send: Callable[[int, bytes], None],
        node: int,
        servo: ServoSpec,
        objects: ObjectDictionary,
        shaft: Shaft,
        *,
        brake: bool,
        smoothing: float = 0.0,
        tolerance: float = 0.0,
        longest_step: float = 1e-3,
        now: float = 0.0,
    ) -> None:
        check_objects(objects, modes_of(servo.modes), node)
        self.node = node
        self.objects = objects
        self.nmt = NodeState.BOOTING
        self._servo, self._shaft, self._quirks = servo, shaft, servo.quirks
        self._tolerance = tolerance
        self._booted_at = now
        self._error = 0
        self._sdo_refuses = self._inhibited = False
        self._line = FrameSender(send, self._emergency)
        self._sdo = SdoServer(objects)
        lost, back = self._host_lost, self._host_back
        self._heartbeats = Heartbeats(objects, self._send_heartbeat, lost, back)
        self._heartbeats.needs_both = self._quirks.needs_both_heartbeats
        self._power = PowerStage(objects, self._state_changed)
        self._power.may_enable = self._may_enable
        self._motion = DriveMotion(
            Settings(objects, servo),
            {Mode.NONE, *modes_of(servo.modes)},
            _brake_of(self._quirks, fitted=brake),
            smoothing=smoothing,
        )
        self._status = StatusBits(objects, self._motion, toggling=self._quirks.toggles_bit_10)
        self._axis = DriveAxis(
            objects,
            shaft,
            self._power,
            self._motion,
            self._status,
            now=now,
            longest_step=longest_step,
        )
        self._axis.following_failed = lambda: self._fault(FAULTS["following error"])
        objects.computed[0x603F, 0] = lambda: self._error
        short = partial(self._emergency, _PDO_TOO_SHORT)
        self._pdos = Pdos(objects, self._line.send, self._axis.sample, short)
        Actions(objects, shaft, self._power, self._motion, quirks=self._quirks)
        self._show_modes()

    # State.

    @property
    def state(self) -> PowerState:
        """State of the power state machine of CiA 402."""
        return self._power.state

    @property
    def error_code(self) -> int:
        """603Fh; 0 while there is no fault."""
        return self._error

    @property
    def switches(self) -> Switches:
        """Limit and home switches of the axis, whose positions may be changed."""
        return self._motion.switches

    # Inputs.

    def power_on(self, now: float, *, boot_time: float | None = None) -> None:
        """Start from power-on; the default boot time is a share of the declared one."""
        self.advance(now)
        wait = self._servo.boot_time * _BOOT_SHARE if boot_time is None else boot_time
        self._booted_at = now + wait
        self._power.reset()
        self.objects.reset()
        self._show_modes()
        self._motion.set_mode(Mode.NONE, self._shaft.motor_angle)
        self._motion.halted = False
        if self._servo.encoder == "incremental":
            self._motion.settings.zero = self._shaft.motor_angle
        self._motion.settings.read_units()
        self._error = 0
        self._sdo.reset()
        self._pdos.rebuild()
        self._heartbeats.producing = True
        self.nmt = NodeState.BOOTING

    def listens(self, identifier: int) -> bool:
        """Whether it is the identifier of a valid RPDO."""
        return self._pdos.listens(identifier)

    def receive(self, identifier: int, data: bytes, now: float) -> None:
        """Take a frame from the bus."""
        if self._line.cut or self.nmt is NodeState.BOOTING:
            return
        if identifier == 0x000:
            self._manage(data, now)
        elif identifier == 0x600 + self.node:
            self._serve_sdo(data, now)
        elif 0x700 < identifier <= 0x77F:
            self._heartbeats.heard(identifier - 0x700, now)
        elif self.nmt is not NodeState.OPERATIONAL:
            return
        elif self._pdos.listens(identifier):
            if not self._pdos.waits(identifier):
                self.advance(now)
            self._pdos.receive(identifier, data)
        elif identifier == self.objects.number(0x1005, 0, 0x80) & 0x7FF:
            self.advance(now)
            self._status.syncs += 1
            self._pdos.latch()
            self._pdos.on_sync(now)

    def tick(self, now: float, all_heard: bool = True) -> None:
        """Advance time to ``now``; missing heartbeats are judged where ``all_heard``."""
        self._axis.advance(now, self._tolerance)
        if self.nmt is NodeState.BOOTING:
            if now >= self._booted_at:
                self._boot_up(now)
            return
        self._heartbeats.produce(now)
        if all_heard:
            self._heartbeats.watch(now)
        self._line.tick(now)
        if self.nmt is NodeState.OPERATIONAL:
            self._pdos.poll(now)

    def inject(self, kind: str) -> None:
        """Inject a fault; raises UsageError for an unknown kind."""
        known(kind)
        if kind in FAULTS:
            self._fault(FAULTS[kind])
        else:
            self._disturb(kind)

    def _disturb(self, kind: str) -> None:
        if kind == "reboot":
            self.power_on(self._axis.now)
        elif kind == "map lost":
            self._pdos.forget()
        elif kind == "host lost":
            self._heartbeats.lose()
        elif kind == "heartbeat stop":
            self._heartbeats.producing = False
        elif kind == "tpdo stop":
            self._pdos.mute = True
        elif kind == "slow sdo":
            self._line.slow_sdo = True
        elif kind == "sdo abort":
            self._sdo_refuses = True
        elif kind == "emergency storm":
            self._line.storm = True
        elif kind == "enable input open":
            self._inhibited = True
            self._power.obey(PowerCommand.DISABLE_VOLTAGE)
        elif kind == "silence":
            self._line.cut = True
        else:
            self._line.recover()
            self._heartbeats.producing = True
            self._pdos.mute = self._sdo_refuses = self._inhibited = False

    # Network.

    def _boot_up(self, now: float) -> None:
        self._line.send(0x700 + self.node, b"\0")
        self.nmt = NodeState.PRE_OPERATIONAL
        self._heartbeats.start(now)
        if self.state is PowerState.NOT_READY:
            self._power.ready()

    def _manage(self, data: bytes, now: float) -> None:
        if len(data) != 2 or data[1] not in (0, self.node):
            return
        self.advance(now)
        command = data[0]
        if command == 0x81:
            self.power_on(now)
        elif command == 0x82:
            self._reset_communication(now)
        elif command in NMT_COMMANDS:
            self._enter_nmt(NMT_COMMANDS[command])

    def _enter_nmt(self, state: NodeState) -> None:
        before, self.nmt = self.nmt, state
        if state is before:
            return
        if state is NodeState.STOPPED:
            self._abort_connection()
        elif before is NodeState.OPERATIONAL and self._quirks.stops_outside_operational:
            self._power.obey(PowerCommand.SHUTDOWN)

    def _reset_communication(self, now: float) -> None:
        self._abort_connection()
        self.objects.reset(_COMMUNICATION)
        self._sdo.reset()
        self._pdos.rebuild()
        self.nmt, self._booted_at = NodeState.BOOTING, now

    def _serve_sdo(self, data: bytes, now: float) -> None:
        if self.nmt is NodeState.STOPPED:
            return
        self.advance(now)
        self._axis.sample()
        reply = self._sdo.refuse(data) if self._sdo_refuses else self._sdo.answer(data)
        if reply is not None:
            self._line.answer(0x580 + self.node, reply, now)

    def _host_lost(self, _node: int) -> None:
        if not self._power.faults_on_abort:
            self._emergency(_HEARTBEAT_LOST.code)
        self._abort_connection()
        behaviour = self.objects.number(0x1029, 1, 0)
        if behaviour == 2:
            self._enter_nmt(NodeState.STOPPED)
        elif behaviour == 0 and self.nmt is NodeState.OPERATIONAL:
            self._enter_nmt(NodeState.PRE_OPERATIONAL)

    def _host_back(self) -> None:
        if not self._error:
            self._emergency(0)

    def _abort_connection(self) -> None:
        if self._power.faults_on_abort:
            self._fault(_HEARTBEAT_LOST)
        else:
            self._power.abort_connection()

    def _emergency(self, code: int) -> None:
        if self.nmt is not NodeState.BOOTING:
            self._line.send(0x80 + self.node, emergency_frame(self.objects, code))

    def _send_heartbeat(self) -> None:
        self._line.send(0x700 + self.node, bytes((self.nmt,)))

    # Power and motion.

    def _may_enable(self) -> bool:
        chosen = not self._quirks.needs_mode or self._motion.mode is not Mode.NONE
        return chosen and not self._inhibited

    def _fault(self, kind: FaultKind) -> None:
        if self.state in (PowerState.FAULT, PowerState.FAULT_REACTION, PowerState.NOT_READY):
            return
        self._error = kind.code
        self._emergency(kind.code)
        self._power.fault(cut=kind.cuts)

    def _state_changed(self, state: PowerState) -> None:
        if state is PowerState.SWITCH_ON_DISABLED and self._error:
            self._error = 0
            self._emergency(0)

    def advance(self, now: float) -> None:
        """Move until ``now``, without evaluating the network's timers."""
        self._axis.advance(now)

    def _show_modes(self) -> None:
        self.objects.put(0x6502, 0, supported(self._motion.modes))


def _brake_of(quirks: QuirkSpec, *, fitted: bool) -> HoldingBrake:
    return HoldingBrake(fitted=fitted, release=quirks.brake_release, apply=quirks.brake_apply)
