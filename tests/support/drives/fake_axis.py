"""A drive without a bus, in simulated time: for the control loop, supervisor and motion logic."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from types import SimpleNamespace

import pytest

from winchkit.bench.control.cable import CableMap
from winchkit.bench.control.controller import Controller
from winchkit.bench.control.dead_man import DeadMan
from winchkit.bench.control.loop import ControlLoop
from winchkit.bench.control.motion import Jog
from winchkit.bench.control.observation import Supervised
from winchkit.bench.control.supervisor import Supervisor
from winchkit.bench.control.winch_state import WinchParts
from winchkit.drivers.can.canopen.nmt import HeartbeatConsumer
from winchkit.drivers.can.cia402.feedback import AxisFeedback
from winchkit.drivers.can.cia402.motor_position import KeptPosition
from winchkit.drivers.can.cia402.state_machine import DriveState, RequestedState, control_word
from winchkit.drivers.reading import InstrumentReading, Quality
from winchkit.errors import ConnectionLost
from winchkit.schema.bench import LimitSpec

CYCLE = 0.004
_NEXT = {
    (DriveState.SWITCH_ON_DISABLED, 0x06): DriveState.READY_TO_SWITCH_ON,
    (DriveState.READY_TO_SWITCH_ON, 0x07): DriveState.SWITCHED_ON,
    (DriveState.SWITCHED_ON, 0x0F): DriveState.OPERATION_ENABLED,
    (DriveState.FAULT, 0x80): DriveState.SWITCH_ON_DISABLED,
    (DriveState.READY_TO_SWITCH_ON, 0x02): DriveState.SWITCH_ON_DISABLED,
    (DriveState.SWITCHED_ON, 0x02): DriveState.SWITCH_ON_DISABLED,
}
_STOPPING_RATE = 50.0


class StraightLine:
    """A drum that never changes: 1 rad of the motor winds 5 mm, 4 m free at zero."""

    def cable_length(self, motor_angle: float) -> float:
        return 4.0 - 0.005 * motor_angle

    def motor_angle(self, cable_length: float) -> float:
        return (4.0 - cable_length) / 0.005

    def arm(self, motor_angle: float) -> float:
        return 0.005


@dataclass
class FakeAxis:
    """Follows speeds at once, ramps in a quick stop; ``words`` are the control words it got."""

    position_mode: bool = False
    angle: float = 0.0
    velocity: float = 0.0
    state: DriveState = DriveState.SWITCH_ON_DISABLED
    words: list[int] = field(default_factory=list)
    heartbeat: HeartbeatConsumer = field(default_factory=lambda: HeartbeatConsumer(0.2))
    operational: bool = True
    mode_kept: bool = True
    fault_text: str = ""
    alive: bool = True
    hears_pdos: bool = True
    hears_sdos: bool = True
    moves_alone: bool = False
    stops_on_nmt: bool = False
    position_jump: str = ""
    nmt_text: str = "operational"
    alarms: tuple[int, ...] = ()
    sdo_stops: int = 0
    torque: float = 0.0
    lag: float = 0.0
    """Time constant with which its speed follows, s."""
    feedback: AxisFeedback | None = None
    _target: float = 0.0
    _sync: tuple[int, float] = (0, 0.0)
    _last: float | None = None

    @property
    def at_rest(self) -> bool:
        return abs(self.velocity) < 0.05

    silent: bool = False
    position_doubt: str = ""

    def __post_init__(self) -> None:
        self.second_master = SimpleNamespace(heard="", last_request=-math.inf, control_words=0)
        self.sdo_stop = SimpleNamespace(
            state=None, refused=False, send=self._stop_by_sdo, end=self._end_stop
        )
        self.position = SimpleNamespace(
            mark=None, disagreement="", trim=0.0, keep=self._keep, lose=self._lose
        )

    def _keep(self, *, closed: bool) -> KeptPosition | None:
        feedback = self.feedback
        if feedback is None:
            return None
        return KeptPosition(round(1e4 * feedback.angle), 0, 0, self.position_doubt, closed)

    def _lose(self, doubt: str) -> None:
        self.position_doubt = self.position.mark = self.position_doubt or doubt

    def fall_silent(self) -> bool:
        self.silent = True
        return False

    def begin_cycle(self, sync: int, now: float) -> None:
        """The fake has answered the SYNC before this one by now."""
        step = 0.0 if self._last is None else now - self._last
        self._last = now
        if not self.alive:
            self._sync = (sync, now)
            return
        self.heartbeat.receive(b"\x05", now)
        if self.state is DriveState.QUICK_STOP_ACTIVE:
            change = _STOPPING_RATE * step
            self.velocity -= math.copysign(min(change, abs(self.velocity)), self.velocity)
            if self.velocity == 0:
                self.state = DriveState.SWITCH_ON_DISABLED
        elif self.state is not DriveState.OPERATION_ENABLED:
            self.velocity = 0.0
        elif self.lag:
            self.velocity += (self._target - self.velocity) * -math.expm1(-step / self.lag)
        self.angle += self.velocity * step
        self.feedback = AxisFeedback(
            self._sync[1], self._sync[0], self.state, 0, self.angle, self.velocity, self.torque
        )
        self._sync = (sync, now)

    def send(
        self,
        requested: RequestedState,
        *,
        velocity: float = 0.0,
        angle: float | None = None,
        start: bool = False,
    ) -> int:
        assert not start, "it makes no motion of its own"
        assert self.feedback is not None
        previous = self.words[-1] if self.words else 0
        age = self._sync[0] - self.feedback.sync
        word = control_word(
            self.feedback.state, requested, previous=previous, age=age, at_rest=self.at_rest
        )
        self.words.append(word)
        if not self.alive or not self.hears_pdos:
            return word
        if word == 0x02 and self.state is DriveState.OPERATION_ENABLED:
            self.state = DriveState.QUICK_STOP_ACTIVE
        self.state = _NEXT.get((self.state, word), self.state)
        if self.state is DriveState.OPERATION_ENABLED and word & 0x0F == 0x0F:
            self._target = velocity
            self.velocity = velocity if not self.lag else self.velocity
            if self.position_mode and angle is not None:
                self.velocity = 25.0 * (angle - self.angle)
        return word

    def _stop_by_sdo(self) -> None:
        """It takes the write in this cycle, and reports its state in the next."""
        self.sdo_stops += 1
        if self.hears_sdos:
            if self.sdo_stops > 1:
                self.sdo_stop.state = self.state
            if self.state is DriveState.OPERATION_ENABLED:
                self.state = DriveState.QUICK_STOP_ACTIVE

    def stop_by_nmt(self) -> None:
        raise AssertionError("it was not seen to leave operation enabled on that")

    def _end_stop(self) -> None:
        self.sdo_stop.state, self.sdo_stops = None, 0

    def emergency_stop(self, *, sdo: bool) -> None:
        """Prepared frames: no feedback is needed."""
        self.words.append(0x02)
        if self.hears_pdos and self.state is DriveState.OPERATION_ENABLED:
            self.state = DriveState.QUICK_STOP_ACTIVE
        if sdo:
            self._stop_by_sdo()


@dataclass
class FakeBus:
    """Counts what is sent."""

    fault: str | None = None
    syncs: int = 0
    beats: int = 0

    def sync(self) -> None:
        if self.fault:
            raise ConnectionLost(self.fault)
        self.syncs += 1

    def heartbeat(self, node: int, state: int) -> None:
        self.beats += 1

    def gather(self) -> None: ...

    def send_gathered(self) -> None: ...


@dataclass
class FakeCell:
    """A load cell whose value and time a test sets."""

    latest: InstrumentReading | None = None
    problem: ConnectionLost | None = None
    max_age: float = 0.25

    def read(self, value: float, now: float, quality: Quality = Quality.GOOD) -> None:
        self.latest = InstrumentReading(value, value, value, quality, now, now, now, 0.0)


class Rig:
    """Winches with fake axes under a real loop, stepped by hand."""

    def __init__(
        self,
        limits: LimitSpec,
        names: str = "A",
        *,
        cell: bool = True,
        cable: CableMap | None = None,
    ) -> None:
        self.now = 100.0
        self.bus = FakeBus()
        self.axes = {name: FakeAxis() for name in names}
        self.cells = {name: FakeCell() for name in names}
        self.limits = limits
        parts = {}
        for name, axis in self.axes.items():
            own = cable or CableMap(StraightLine())
            sensors = {"cell": self.cells[name]} if cell else {}
            parts[name] = WinchParts(axis, own, Controller(axis, own, limits), sensors)
        self.supervisor = Supervisor(dict.fromkeys(names, Supervised(limits, 0.05, CYCLE)))
        self.loop = ControlLoop(
            [(self.bus, 127, 0.05)], parts, self.supervisor, self, CYCLE, longest_gap=0.1
        )
        self.tension: dict[str, float | None] = dict.fromkeys(names, 100.0)
        self.speeds: list[float] = []
        self.step(3)

    def controller(self, name: str = "A") -> Controller:
        return self.loop.winches[name].controller

    def cable(self, name: str = "A") -> CableMap:
        return self.loop.winches[name].cable

    def jog(self, speed: float, hold: float = 1e6) -> Jog:
        """Winch A begins to jog, for a long time unless it is held for a shorter one."""
        source = Jog(self.cable(), self.limits, speed, DeadMan(self.now + hold))
        self.controller().begin(source)
        return source

    def sleep(self, duration: float) -> None:
        raise AssertionError("simulated time does not sleep")

    def step(self, count: int = 1) -> None:
        for _ in range(count):
            self.now += CYCLE
            for name, cell in self.cells.items():
                value = self.tension[name]
                if value is not None:
                    cell.read(value, self.now)
            self.loop.step(self.now)
            self.speeds.append(next(iter(self.axes.values())).velocity * 0.005)

    def run(self, duration: float) -> None:
        self.step(round(duration / CYCLE))


def moving_rig(limits: LimitSpec, speed: float = 0.2, names: str = "AB") -> Rig:
    """Winches of which A jogs for a long time."""
    rig = Rig(limits, names)
    rig.jog(speed)
    rig.run(0.5)
    assert rig.speeds[-1] == pytest.approx(speed)
    return rig
