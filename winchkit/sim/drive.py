"""A simulated CiA 402 servo drive: an independent device on a CAN bus that moves a plant."""

from __future__ import annotations

from collections.abc import Callable

from winchkit.schema.device import ServoSpec
from winchkit.sim.drive_axis import Axis
from winchkit.sim.drive_faults import ERROR_CODES, known
from winchkit.sim.drive_guards import guard_options
from winchkit.sim.drive_motion import SIMULATED_MODES, Mode, Motion
from winchkit.sim.drive_network import Heartbeats, NmtState, emergency_frame
from winchkit.sim.drive_pdo import Pdos
from winchkit.sim.drive_power import PowerStage
from winchkit.sim.drive_sdo import SdoServer
from winchkit.sim.drive_shaft import Shaft
from winchkit.sim.drive_state import HALT, State
from winchkit.sim.drive_status import SetPointHandshake
from winchkit.sim.drive_units import units_of
from winchkit.sim.object_dictionary import Abort, ObjectDictionary

__all__ = ["SimDrive"]

_BOOT_SHARE = 0.8
"""Of the boot time that a device file declares as the longest."""
_HEARTBEAT_LOST = 0x8130
_PDO_TOO_SHORT = 0x8210
_NMT_COMMANDS = {
    0x01: NmtState.OPERATIONAL,
    0x02: NmtState.STOPPED,
    0x80: NmtState.PRE_OPERATIONAL,
}
_FOLLOWING_ERROR = ERROR_CODES["following error"]
_COMMUNICATION = range(0x1000, 0x2000)


class SimDrive:
    """One drive, driven by a clock that is handed in.

    ``objects`` is its object dictionary, which it takes over. ``send`` takes an identifier and
    data. Frames come in through :meth:`receive`, time through
    :meth:`tick`; both take the time in s of one steady clock and are called from one thread.
    ``smoothing`` is the length of its set-point filter in CSV, s.
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
        now: float = 0.0,
    ) -> None:
        self.node = node
        self.objects = objects
        self.nmt = NmtState.BOOTING
        self._send_frame, self._servo, self._shaft = send, servo, shaft
        self._booted_at = now
        self._error = 0
        self._silent = False
        self._sdo = SdoServer(self.objects)
        self._pdos = Pdos(
            self.objects, self._send, self._sample, lambda: self._emergency(_PDO_TOO_SHORT)
        )
        self._heartbeats = Heartbeats(
            self.objects, self._send_heartbeat, self._host_lost, self._host_back
        )
        self._power = PowerStage(self.objects, self._state_changed)
        units = units_of(self.objects, servo)
        self._motion = Motion(self.objects, units, brake=brake, smoothing=smoothing)
        self._handshake = SetPointHandshake(self.objects, self._motion)
        self._axis = Axis(self.objects, shaft, self._power, self._motion, now=now)
        self._axis.following_failed = lambda: self._fault(_FOLLOWING_ERROR)
        self._guard_objects()
        self.objects.put(0x6502, 0, SIMULATED_MODES)

    # What it is doing.

    @property
    def state(self) -> State:
        """Of CiA 402."""
        return self._power.state

    @property
    def error_code(self) -> int:
        """603Fh; 0 while there is no fault."""
        return self._error

    # What happens to it.

    def power_on(self, now: float, *, boot_time: float | None = None) -> None:
        """Begin from power-on; by default it takes a good part of the declared boot time."""
        self.advance(now)
        wait = self._servo.boot_time * _BOOT_SHARE if boot_time is None else boot_time
        self._booted_at = now + wait
        self._power.reset()
        self.objects.reset()
        self.objects.put(0x6502, 0, SIMULATED_MODES)
        self._motion.set_mode(Mode.NONE, self._shaft.motor_angle)
        self._motion.halted = False
        self._motion.units = units_of(self.objects, self._servo)
        self._error = 0
        self._sdo.reset()
        self._pdos.rebuild()
        self._heartbeats.producing = True
        self.nmt = NmtState.BOOTING

    def receive(self, identifier: int, data: bytes, now: float) -> None:
        """Take a frame from the bus."""
        if self._silent or self.nmt is NmtState.BOOTING:
            return
        if identifier == 0x000:
            self._manage(data, now)
        elif identifier == 0x600 + self.node:
            self._serve_sdo(data, now)
        elif 0x700 < identifier <= 0x77F:
            self._heartbeats.heard(identifier - 0x700, now)
        elif self.nmt is NmtState.OPERATIONAL:
            self.advance(now)
            if identifier == self.objects.number(0x1005) & 0x7FF:
                self._pdos.latch()
                self._pdos.on_sync(now)
            else:
                self._pdos.receive(identifier, data)

    def tick(self, now: float) -> None:
        """Let time pass until ``now``."""
        self.advance(now)
        if self.nmt is NmtState.BOOTING:
            if now >= self._booted_at:
                self._boot_up(now)
            return
        self._heartbeats.tick(now)
        if self.nmt is NmtState.OPERATIONAL:
            self._pdos.poll(now)

    def inject(self, kind: str) -> None:
        """Make something go wrong now; raises UsageError for an unknown kind."""
        known(kind)
        if kind in ERROR_CODES:
            self._fault(ERROR_CODES[kind])
        elif kind == "reboot":
            self.power_on(self._axis.now)
        elif kind == "heartbeat stop":
            self._heartbeats.producing = False
        elif kind == "silence":
            self._silent = True
        else:
            self._silent, self._heartbeats.producing = False, True

    # Network.

    def _boot_up(self, now: float) -> None:
        self._send(0x700 + self.node, b"\0")
        self.nmt = NmtState.PRE_OPERATIONAL
        self._heartbeats.start(now)
        if self.state is State.NOT_READY:
            self._power.ready()

    def _manage(self, data: bytes, now: float) -> None:
        if len(data) != 2 or data[1] not in (0, self.node):
            return
        self.advance(now)
        command, before = data[0], self.nmt
        if command == 0x81:
            self.power_on(now)
        elif command == 0x82:
            self._reset_communication(now)
        elif command in _NMT_COMMANDS:
            self.nmt = _NMT_COMMANDS[command]
            if self.nmt is NmtState.STOPPED and before is not self.nmt:
                self._abort_connection()

    def _reset_communication(self, now: float) -> None:
        self._abort_connection()
        self.objects.reset(_COMMUNICATION)
        self._sdo.reset()
        self._pdos.rebuild()
        self.nmt, self._booted_at = NmtState.BOOTING, now

    def _serve_sdo(self, data: bytes, now: float) -> None:
        if self.nmt is NmtState.STOPPED:
            return
        self.advance(now)
        self._sample()
        reply = self._sdo.answer(data)
        if reply is not None:
            self._send(0x580 + self.node, reply)

    def _host_lost(self, _node: int) -> None:
        if not self._power.faults_on_abort:
            self._emergency(_HEARTBEAT_LOST)
        self._abort_connection()
        behaviour = self.objects.number(0x1029, 1) if (0x1029, 1) in self.objects else 0
        if behaviour == 2:
            self.nmt = NmtState.STOPPED
        elif behaviour == 0 and self.nmt is NmtState.OPERATIONAL:
            self.nmt = NmtState.PRE_OPERATIONAL

    def _host_back(self) -> None:
        if not self._error:
            self._emergency(0)

    def _abort_connection(self) -> None:
        if self._power.faults_on_abort:
            self._fault(_HEARTBEAT_LOST)
        else:
            self._power.abort_connection()

    def _emergency(self, code: int) -> None:
        if self._booted:
            self._send(0x80 + self.node, emergency_frame(self.objects, code))

    @property
    def _booted(self) -> bool:
        return self.nmt is not NmtState.BOOTING

    def _send_heartbeat(self) -> None:
        self._send(0x700 + self.node, bytes((self.nmt,)))

    def _send(self, identifier: int, data: bytes) -> None:
        if not self._silent:
            self._send_frame(identifier, data)

    # Power and motion.

    def _fault(self, code: int) -> None:
        if self.state in (State.FAULT, State.FAULT_REACTION, State.NOT_READY):
            return
        self._error = code
        self._emergency(code)
        self._power.fault()

    def _state_changed(self, state: State) -> None:
        if state is State.SWITCH_ON_DISABLED and self._error:
            self._error = 0
            self._emergency(0)

    def advance(self, now: float) -> None:
        """Move until ``now``, without looking at the network's timers."""
        self._axis.advance(now)

    def _sample(self) -> None:
        acknowledged = self._handshake.acknowledged
        self._axis.sample(self._error, acknowledged=acknowledged)

    # Objects that do something when they are written.

    def _guard_objects(self) -> None:
        guard_options(self.objects)
        guards, watchers = self.objects.guards, self.objects.watchers
        for index in (0x608F, 0x6091, 0x6076):
            guards[index] = self._check_scale
            watchers[index] = self._scale_again
        watchers[0x6040] = self._control
        watchers[0x6060] = lambda _sub, value: self._motion.set_mode(
            Mode(value), self._shaft.motor_angle
        )
        for index in (0x607A, 0x60FF, 0x60B0, 0x60B1):
            watchers[index] = lambda _sub, _value: self._aim()

    def _control(self, _sub: int, word: int) -> None:
        self._motion.halted = bool(word & HALT)
        self._power.control(word)
        enabled = self.state is State.OPERATION_ENABLED
        self._handshake.take(word, self._shaft.motor_angle, enabled=enabled)

    def _aim(self) -> None:
        if self._motion.mode in (Mode.CSP, Mode.CSV):
            self._motion.aim()

    def _check_scale(self, _sub: int, value: int) -> Abort | None:
        if self.state in (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE, State.FAULT_REACTION):
            return Abort.STATE
        return Abort.RANGE if value == 0 else None

    def _scale_again(self, _sub: int, _value: int) -> None:
        self._motion.units = units_of(self.objects, self._servo)
        self._axis.forget_sample()
