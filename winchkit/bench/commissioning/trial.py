"""Trials on an enabled drive, in a cycle of their own: host loss, NMT stopped, holding brake.

The control loop of an open bench would stop the drive by other ways before the one under trial
acts; so a trial wires the bench without starting that loop. Only one drive is ever enabled, at rest
or at the given slow speed, for less than two seconds; whatever ends a trial, its last frames are a
quick stop.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from typing import Self

from winchkit.bench.control.cable import CableMap
from winchkit.bench.control.controller import ENABLE_TIME
from winchkit.bench.hardware import Wired, wire
from winchkit.bench.records.latch import LatchFile
from winchkit.bench.records.position_file import PositionFile
from winchkit.drivers.can.canopen.nmt import HeartbeatProducer, NmtCommand, NmtState
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.cia402.motor_position import KeptPosition
from winchkit.drivers.can.cia402.state_machine import (
    DISABLE_VOLTAGE,
    QUICK_STOP,
    DriveState,
    RequestedState,
    has_left,
    state_of,
)
from winchkit.drivers.can.host_loss.mechanism import Mechanism, Silence
from winchkit.drivers.can.host_loss.proof import bring_back
from winchkit.drivers.clock import Clock
from winchkit.errors import ConnectionLost, MotionError, NoReply, NotPermitted
from winchkit.schema.bench import BenchSpec

_SETTLE_TIME = 0.3
"""s: oscillation at rest after enabling has decayed before a trial."""
_MOVE_TIME = 0.8
"""s: a ramp and several heartbeats at constant speed before the host falls silent."""
_TIMEOUT = 0.5
"""For the drive beyond its limit, s."""
_HARDWARE_TIMEOUT = 5.0
"""s: a safety relay with a delay of category 1 stop (up to some seconds)."""
_NMT_TIME = 0.15
"""s: three heartbeats of 50 ms, after which the drive shows its reaction."""
_BRAKE_TIME = 2.0
"""s: a brake that does not hold lets the load slip visibly within it."""
_REST_TIME = 3.0
"""s, as in :mod:`winchkit.drivers.can.cia402.commission`: three times the quick stop from 1 m/s
with 1 m/s²."""
_FRESH = 5
"""Cycles after which every drive has answered with where it stands."""
_POLL = 0.002
"""s: resolution of a measured reaction, 2 % of the shortest limit."""
_REPLY_TIME = 0.1
"""Within which a drive has answered an SDO request that needs no ramp, s."""
_HALF = 1 << 31
"""Half the range of 6064h (INTEGER32), past which its counts wrap."""


@dataclass(frozen=True)
class TrialResult:
    """Result of one trial."""

    stopped: bool
    """Whether the drive left operation enabled."""
    after: float
    """From the last life sign, or the command, until that was seen, s."""
    state: str
    """Its state then, in words."""
    travel: float = 0.0
    """Change of the cable length from then until the drive was at rest, m; positive pays out."""


class Trials:
    """A bench that is wired for trials; a context manager."""

    def __init__(self, spec: BenchSpec, clock: Clock) -> None:
        """Wire a bench that the caller owns: drives disabled, each mechanism proved so."""
        self.spec, self._clock = spec, clock
        with ExitStack() as stack:
            latch = LatchFile(spec.latch_file)
            stack.callback(latch.close)
            if trips := latch.open():
                raise NotPermitted(f"{trips[0]}; run `winchkit reset` before commissioning")
            self._positions = PositionFile(spec.position_file)
            stack.callback(self._positions.close)
            if trips := self._positions.open():
                raise NotPermitted(f"{trips[0]}; run `winchkit reset` before commissioning")
            self._wired: Wired = wire(spec, clock, stack, latch, self._positions)
            self.axes = self._wired.axes
            self._stack = stack.pop_all()
        self._sync, self._hold = 0, 0.0
        self._beats = [
            (bus, spec.bus[name].node, HeartbeatProducer(spec.bus[name].heartbeat))
            for name, bus in self._wired.buses.items()
        ]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        with self._stack:
            if kind is None:
                self._keep_positions()
            for axis in self.axes.values():
                with suppress(ConnectionLost):
                    axis.host.disarm()

    def _keep_positions(self) -> None:
        """Close the record of positions with where the drives are now, disabled and at rest."""
        axes = self.axes
        for _ in range(_FRESH):
            self._cycle(next(iter(axes.values())), RequestedState.DISABLE)
        found = {name: axis.position.keep(closed=axis.at_rest) for name, axis in axes.items()}
        self._positions.close_with({name: kept for name, kept in found.items() if kept is not None})

    def host_loss(self, name: str, speed: float = 0.0) -> TrialResult:
        """Fall silent with the drive enabled, at rest or winding in at ``speed`` (m/s)."""
        with self._ended(name) as axis:
            self._enable(axis)
            if speed:
                self._require_room(name, axis, speed)
            self._run(axis, speed, _MOVE_TIME if speed else _SETTLE_TIME, name)
            start, angle = self._clock.now(), _angle(axis)
            limit, timeout = axis.host.mechanism.limit, _timeout(axis.host.mechanism)
            # Where any frame is a life sign the drive is not asked before its time is over.
            blind = limit + _TIMEOUT / 2 if axis.host.mechanism.silence is Silence.ALL else 0.0
            state, after = self._left(axis, start, blind, timeout)
            stopped = has_left(state)
            if stopped:
                self._await_rest(axis)
            travel = self._travel(name, axis, angle)
        return TrialResult(stopped, after, str(state), travel)

    def room(self, name: str) -> str:
        """Warning that no length limit is kept in a trial in motion; empty where it is."""
        if not self.axes[name].position_doubt:
            return ""
        return " The cable length is not known, and limits.length not kept: look for room yourself."

    def nmt_stopped(self, name: str) -> TrialResult:
        """NMT stopped with the drive enabled at rest; every other life sign goes on."""
        with self._ended(name) as axis:
            self._enable(axis)
            self._run(axis, 0.0, _SETTLE_TIME, name)
            start = self._clock.now()
            axis.stop_by_nmt()
            self._run(axis, 0.0, _NMT_TIME, name)
            # Only a state with SDO can be asked; RPDOs are not processed in it.
            axis.objects.bus.nmt(NmtCommand.ENTER_PRE_OPERATIONAL, axis.objects.node)
            state = state_of(axis.objects.read(0x6041))
            after = self._clock.now() - start
        return TrialResult(has_left(state), after, str(state))

    def brake(self, name: str) -> TrialResult:
        """Enable the drive at rest, disable it, and see whether the cable moves after that."""
        with self._ended(name) as axis:
            self._enable(axis)
            self._run(axis, 0.0, _SETTLE_TIME, name)
            angle, start = _angle(axis), self._clock.now()
            while self._clock.now() - start < _BRAKE_TIME:
                self._cycle(axis, RequestedState.DISABLE)
            travel = self._travel(name, axis, angle)
            state = _asked(axis)
        return TrialResult(has_left(state), _BRAKE_TIME, str(state), travel)

    @contextmanager
    def _ended(self, name: str) -> Iterator[Cia402Axis]:
        """Whatever happens, the drive is stopped, disabled, cleared and set up anew afterwards.

        Meanwhile its entry in the record of positions is open.
        """
        axis = self.axes[name]
        for _ in range(_FRESH):
            self._cycle(axis, RequestedState.DISABLE)
        self._keep(name, axis.position.keep(closed=False))
        try:
            yield axis
        except BaseException:
            with suppress(ConnectionLost):  # the later steps are still necessary
                axis.emergency_stop(sdo=True)
                self._wired_syncs()
            # The reply to the stop by SDO is not for the confirmed client.
            self._clock.sleep(_REPLY_TIME)
            axis.sdo_stop.end()
            self._recover(name)
            raise
        self._recover(name)

    def _keep(self, name: str, kept: KeptPosition | None) -> None:
        """Write the entry of a winch; raises NotPermitted where the record cannot be written."""
        if kept is not None and (problem := self._positions.keep({name: kept})) is not None:
            raise NotPermitted(str(problem))

    def _wired_syncs(self) -> None:
        for bus, _, _ in self._beats:
            bus.sync()

    def _recover(self, name: str) -> None:
        axis = self.axes[name]
        node = axis.objects
        # A drive that stopped (1029h:1 = 2, NMT stopped) answers SDO only when pre-operational.
        node.bus.nmt(NmtCommand.ENTER_PRE_OPERATIONAL, node.node)
        if state_of(node.read(0x6041)) is DriveState.OPERATION_ENABLED:
            node.write(0x6040, 0, QUICK_STOP)
        self._await_rest(axis)
        for one in self.axes.values():
            one.objects.bus.nmt(NmtCommand.ENTER_PRE_OPERATIONAL, one.objects.node)
            one.objects.write(0x6040, 0, DISABLE_VOLTAGE)
            bring_back(one.objects, self._clock, clears=True)
            one.commission()
        # By SDO: after SYNC and a heartbeat the drives would miss them while a question is open.
        kept = axis.position.keep(closed=True)
        self._keep(name, kept and replace(kept, count=node.read(0x6064)))

    def _enable(self, axis: Cia402Axis) -> None:
        deadline = self._clock.now() + ENABLE_TIME
        while axis.state is not DriveState.OPERATION_ENABLED:
            self._cycle(axis, RequestedState.ENABLE)
            if self._clock.now() > deadline:
                raise NotPermitted(
                    f"{axis.name}: still {axis.state} {ENABLE_TIME:g} s after the command to "
                    f"enable: {axis.fault_text}; look at its enable input, supply and errors"
                )
        self._hold = _angle(axis)

    def _run(self, axis: Cia402Axis, speed: float, duration: float, name: str) -> None:
        """Keep it enabled; the speed is reached on the winch's own ramp."""
        cable: CableMap = self._wired.loop.winches[name].cable
        arm = cable.arm(self._hold)
        wanted = speed / arm
        slope = self.spec.winch[name].limits.acceleration / abs(arm)
        start = last = self._clock.now()
        velocity, angle = 0.0, self._hold
        while (now := self._clock.now()) - start < duration:
            dt, last = now - last, now
            velocity += max(-slope * dt, min(slope * dt, wanted - velocity))
            angle += velocity * dt
            self._cycle(axis, RequestedState.ENABLE, velocity, angle)

    def _require_room(self, name: str, axis: Cia402Axis, speed: float) -> None:
        """Raise NotPermitted where winding in at ``speed`` may pass the lower length limit.

        Where the length is not known, the operator has seen to it. The way: the move, the drive's
        time limit without a host (for hardware that stops it the timeout of the trial), and the
        ramp v²/(2a).
        """
        limits = self.spec.winch[name].limits
        if limits.length is None or axis.position_doubt:
            return
        moving = _MOVE_TIME + _timeout(axis.host.mechanism)
        way = speed * moving + speed**2 / (2 * limits.acceleration)
        cable: CableMap = self._wired.loop.winches[name].cable
        length, low = cable.cable_length(self._hold), limits.length[0]
        if not length - way >= low:
            raise NotPermitted(
                f"winch {name}: cable length {length:.3f} m: winding in at {speed:g} m/s until the "
                f"drive stops by itself may take {way:.3f} m, below the limit {low:g} m; pay "
                "out first, or answer 'no' to the trial in motion"
            )

    def _cycle(
        self,
        axis: Cia402Axis,
        requested: RequestedState,
        velocity: float = 0.0,
        angle: float | None = None,
    ) -> None:
        now = self._clock.now()
        self._sync += 1
        for one in self.axes.values():
            one.begin_cycle(self._sync, now)
        for bus, host, producer in self._beats:
            bus.sync()
            if producer.due(now):
                bus.heartbeat(host, NmtState.OPERATIONAL)
        self._clock.sleep(self.spec.cycle)
        for one in self.axes.values():
            if one is axis:
                one.send(requested, velocity=velocity, angle=angle)
            else:
                one.send(RequestedState.DISABLE)

    def _left(
        self, axis: Cia402Axis, start: float, blind: float, timeout: float
    ) -> tuple[DriveState, float]:
        """The first state that is known and not operation enabled, and when; or the last one."""
        self._clock.sleep(blind)
        while True:
            state = _asked(axis)
            after = self._clock.now() - start
            if has_left(state) or after > timeout:
                return state, after
            self._clock.sleep(_POLL)

    def _await_rest(self, axis: Cia402Axis) -> None:
        deadline = self._clock.now() + _REST_TIME
        while _asked(axis) in (DriveState.FAULT_REACTION_ACTIVE, DriveState.QUICK_STOP_ACTIVE):
            if not axis.objects.read_if_there(0x606C):
                return
            if self._clock.now() > deadline:
                raise MotionError(
                    f"{axis.name}: not at rest {_REST_TIME:g} s after it stopped; use the "
                    "emergency stop and look at the drive"
                )
            self._clock.sleep(_POLL)

    def _travel(self, name: str, axis: Cia402Axis, angle: float) -> float:
        """Of the cable since an angle, by the drive's position object; positive pays out."""
        assert axis.drive is not None, "it was enabled"
        cable: CableMap = self._wired.loop.winches[name].cable
        feedback = axis.feedback
        assert feedback is not None, "it was enabled"
        unit = axis.drive.scale.angle
        # Less than half of the counter's range, whichever way: it may wrap.
        counts = axis.objects.read(0x6064) - round(feedback.angle / unit)
        now = feedback.angle + ((counts + _HALF) % (2 * _HALF) - _HALF) * unit
        return cable.cable_length(now) - cable.cable_length(angle)


def _timeout(mechanism: Mechanism) -> float:
    """How long a trial waits for a drive to stop once the host is silent, s."""
    nothing = mechanism.silence is Silence.NOTHING
    return _HARDWARE_TIMEOUT if nothing else mechanism.limit + _TIMEOUT


def _asked(axis: Cia402Axis) -> DriveState:
    """Power state by SDO; a drive whose network state is stopped has to leave that first."""
    node = axis.objects
    try:
        return state_of(node.read(0x6041))
    except NoReply:
        node.bus.nmt(NmtCommand.ENTER_PRE_OPERATIONAL, node.node)
        return state_of(node.read(0x6041))


def _angle(axis: Cia402Axis) -> float:
    feedback = axis.feedback
    if feedback is None:
        raise NotPermitted(f"{axis.name}: sends no PDOs on SYNC; check its PDO mapping")
    return feedback.angle
