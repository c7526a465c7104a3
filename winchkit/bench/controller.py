"""One winch in the control loop: which wish and target its drive gets in each cycle."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Protocol

from winchkit.bench.motion import MotionSource, RunDown, Target
from winchkit.bench.rope import RopeMap
from winchkit.bench.snapshot import Phase
from winchkit.bench.start_gate import StartGate
from winchkit.drivers.can.axis import AxisFeedback
from winchkit.drivers.can.cia402 import State, Wish
from winchkit.drivers.can.heartbeat import HeartbeatWatch
from winchkit.schema.bench import LimitSpec

__all__ = ["AxisPort", "Controller"]

_ENABLE_TIME = 2.0
_GATE_TIME = 5.0
"""How long an enabled drive waits for others that are to start with it, s."""
_RESET_TIME = 1.0
_RUN_DOWN_MARGIN = 1.0
_HEEDED_WITHIN = 0.5
"""A drive that heeds a stop leaves 'operation enabled' within this time, s."""
_ENABLED = (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE, State.FAULT_REACTION_ACTIVE)


class AxisPort(Protocol):
    """What the loop needs of an axis; ``Cia402Axis`` is one."""

    heartbeat: HeartbeatWatch

    @property
    def feedback(self) -> AxisFeedback | None:
        """Newest feedback."""

    @property
    def at_rest(self) -> bool:
        """Whether the motor stands still."""

    @property
    def operational(self) -> bool:
        """Whether its PDOs run."""

    @property
    def mode_kept(self) -> bool:
        """Whether it is still in its mode."""

    @property
    def fault_text(self) -> str:
        """Its fault in words."""

    def begin_cycle(self, sync: int, now: float) -> None:
        """Note a SYNC."""

    def send(
        self,
        wish: Wish,
        *,
        velocity: float = 0.0,
        angle: float | None = None,
        start: bool = False,
    ) -> int:
        """Send a command; ``start`` lets the drive make a motion of its own."""


@dataclass(frozen=True)
class _Order:
    """A motion that is asked for."""

    source: MotionSource
    gate: StartGate | None

    def may_start(self, time: float) -> bool:
        """Whether nobody has to be waited for in this cycle."""
        return self.gate is None or self.gate.open(time)


class Controller:
    """Phases from disabled over moving back to disabled.

    ``begin``, ``run_down`` and ``stop`` may be called from any thread; they take effect in the
    next ``step``.
    """

    def __init__(self, axis: AxisPort, rope: RopeMap, limits: LimitSpec) -> None:
        self.axis = axis
        self.rope = rope
        self.limits = limits
        self.phase = Phase.DISABLED
        self.source: MotionSource | None = None
        self.done = True
        """Whether the last source has finished."""
        self.failure = ""
        """Why the last source could not go on, when the drive is to blame."""
        self.stopped = False
        """Whether somebody stopped the last source before its end."""
        self.reason = ""
        """Why, where another winch is to blame."""
        self.commanded = 0.0
        """Rope speed commanded last, m/s."""
        self._wanted: _Order | None = None
        self._begun: _Order | None = None
        self._ordered: Phase | None = None
        self._lock = threading.Lock()
        self._down = RunDown(rope, limits)
        self._angle = 0.0
        self._held: float | None = None
        self._told = True
        self._since = self._time = 0.0

    def new_failure(self) -> str:
        """Why the drive could not go on, told once; empty where it could."""
        told, self._told = self._told, True
        return "" if told else self.failure

    def begin(self, source: MotionSource, gate: StartGate | None = None) -> None:
        """Start a source, enabling the drive first where needed; replaces the one before.

        With a ``gate`` it waits, enabled and holding its place, until the gate opens.
        """
        with self._lock:
            self.done = self.stopped = False
            self.failure = self.reason = ""
            self._wanted = _Order(source, gate)

    def ready_for(self, source: MotionSource) -> bool:
        """Whether the drive is enabled, at rest, and waits for nothing but this source."""
        feedback = self.axis.feedback
        if feedback is None or feedback.state is not State.OPERATION_ENABLED:
            return False
        if self.phase is Phase.ENABLING:
            return self.source is source
        waits = self._wanted is not None and self._wanted.source is source
        return waits and self.phase in (Phase.MOVING, Phase.RUN_DOWN) and self.commanded == 0.0

    def run_down(self) -> None:
        """Ramp to rest, then disable."""
        self._order(Phase.RUN_DOWN)

    def stop(self, reason: str = "") -> None:
        """Quick stop, then disable; ``reason`` names another winch that is to blame."""
        self._order(Phase.STOPPING, reason)

    def reset(self) -> None:
        """Clear a drive's fault; it stays disabled."""
        self._order(Phase.RESETTING)

    def step(self, now: float, time: float) -> None:
        """Send this cycle's command; ``time`` is that of motion, one cycle a cycle."""
        self._time = time
        self._take_orders(now)
        feedback = self.axis.feedback
        if feedback is None:
            return
        {
            Phase.DISABLED: self._stay_disabled,
            Phase.ENABLING: self._enable,
            Phase.MOVING: self._move,
            Phase.RUN_DOWN: self._slow_down,
            Phase.STOPPING: self._stop,
            Phase.RESETTING: self._reset,
        }[self.phase](now, feedback)

    def unheeded(self, now: float) -> bool:
        """Whether a stop is under way and nothing says that the drive takes it.

        A drive that lost its mapping hears no control word, and goes on as it was told last.
        """
        if self.phase is not Phase.STOPPING or now - self._since < _HEEDED_WITHIN:
            return False
        feedback = self.axis.feedback
        if feedback is None or now - feedback.time > _HEEDED_WITHIN:
            return True
        return feedback.state is State.OPERATION_ENABLED

    def _order(self, phase: Phase, reason: str = "") -> None:
        with self._lock:
            if self._wanted is not None or (self.source is not None and not self.done):
                self.stopped, self.reason = True, reason
            self._wanted = None
            if self._ordered is not Phase.STOPPING:
                self._ordered = phase

    def _take_orders(self, now: float) -> None:
        with self._lock:
            ordered, self._ordered = self._ordered, None
            wanted = self._wanted
        if ordered is Phase.STOPPING:
            self._enter(Phase.STOPPING, now)
        elif ordered is Phase.RESETTING and self.phase is Phase.DISABLED:
            self._enter(Phase.RESETTING, now)
        elif ordered is Phase.RUN_DOWN and self.phase in (Phase.ENABLING, Phase.MOVING):
            self._begin_run_down(now)
        if wanted is not None and self._take(wanted, now):
            with self._lock:
                if self._wanted is wanted:
                    self._wanted = None

    def _take(self, wanted: _Order, now: float) -> bool:
        """Start a source now where that is smooth, else get ready for it; whether it is taken."""
        feedback = self.axis.feedback
        if feedback is not None and self.phase in (Phase.MOVING, Phase.RUN_DOWN):
            if wanted.source.joins or self.commanded == 0.0:
                if not wanted.may_start(self._time):
                    return False
                wanted.source.start(self._time, feedback.angle, self.commanded)
                self.source, self.done = wanted.source, False
                self.phase, self._since = Phase.MOVING, now
                return True
            if self.phase is Phase.MOVING:
                self._begin_run_down(now)
        elif self.phase in (Phase.DISABLED, Phase.ENABLING):
            self.phase, self.source, self._since = Phase.ENABLING, wanted.source, now
            self._begun, self._held = wanted, None
            return True
        return False

    def _enter(self, phase: Phase, now: float) -> None:
        self.phase, self._since = phase, now
        if phase in (Phase.STOPPING, Phase.DISABLED, Phase.RESETTING):
            self.source, self.commanded = None, 0.0
            self.done = self._wanted is None

    def _fail(self, reason: str, now: float) -> None:
        self.failure, self._told = reason, False
        self._enter(Phase.STOPPING, now)

    def _stay_disabled(self, now: float, feedback: AxisFeedback) -> None:
        self.axis.send(Wish.DISABLE)
        if feedback.state is State.OPERATION_ENABLED:
            self._enter(Phase.STOPPING, now)

    def _enable(self, now: float, feedback: AxisFeedback) -> None:
        enabled = feedback.state is State.OPERATION_ENABLED
        if enabled and self._begun is not None and self._begun.may_start(self._time):
            self._begun.source.start(self._time, feedback.angle, 0.0)
            self._angle = feedback.angle
            self._enter(Phase.MOVING, now)
            self._move(now, feedback)
            return
        if enabled and self._held is None:
            self._held = feedback.angle
        self.axis.send(Wish.ENABLE, angle=self._held)
        if now - self._since > (_GATE_TIME if enabled else _ENABLE_TIME):
            waiting = "waits for a winch that was to start with it"
            stays = f"the drive stays {feedback.state} for {_ENABLE_TIME:g} s"
            self._fail(waiting if enabled else stays, now)

    def _move(self, now: float, feedback: AxisFeedback) -> None:
        if self.source is None or feedback.state is not State.OPERATION_ENABLED:
            self._fail(f"the drive went to {feedback.state} by itself", now)
            self._stop(now, feedback)
            return
        target = self.source.target(self._time, feedback.angle, now)
        self._follow(target, feedback)
        if target.done:
            self.done = True
            if not self.source.holds:
                self._begin_run_down(now)

    def _follow(self, target: Target, feedback: AxisFeedback) -> None:
        fastest = self.limits.speed / abs(self.rope.at(feedback.angle)[1])
        velocity = max(-fastest, min(fastest, target.velocity))
        self.commanded = target.speed
        if target.angle is not None:
            self._angle = target.angle
        self.axis.send(Wish.ENABLE, velocity=velocity, angle=target.angle, start=target.start)

    def _begin_run_down(self, now: float) -> None:
        self._down = RunDown(self.rope, self.limits)
        self._down.start(self._time, self._angle, self.commanded)
        self._enter(Phase.RUN_DOWN, now)
        self.source, self.done = None, self._wanted is None

    def _slow_down(self, now: float, feedback: AxisFeedback) -> None:
        target = self._down.target(self._time, feedback.angle, now)
        self.commanded = target.speed
        late = now - self._since > self._down.duration + _RUN_DOWN_MARGIN
        settled = target.done and self.axis.at_rest and self._wanted is None
        if settled or late or feedback.state is not State.OPERATION_ENABLED:
            self._enter(Phase.STOPPING, now)
            self._stop(now, feedback)
            return
        self.axis.send(Wish.RUN_DOWN, velocity=target.velocity, angle=target.angle)

    def _stop(self, now: float, feedback: AxisFeedback) -> None:
        self.axis.send(Wish.DISABLE)
        if feedback.state not in _ENABLED and self.axis.at_rest:
            self._enter(Phase.DISABLED, now)

    def _reset(self, now: float, feedback: AxisFeedback) -> None:
        self.axis.send(Wish.RESET)
        if feedback.state is not State.FAULT or now - self._since > _RESET_TIME:
            self._enter(Phase.DISABLED, now)
