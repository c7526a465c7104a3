"""One winch in the control loop: which wish and target its drive gets in each cycle."""

from __future__ import annotations

import threading
from typing import Protocol

from winchkit.bench.motion import MotionSource, RunDown, Target
from winchkit.bench.rope import RopeMap
from winchkit.bench.snapshot import Phase
from winchkit.drivers.can.axis import AxisFeedback
from winchkit.drivers.can.cia402 import State, Wish
from winchkit.drivers.can.heartbeat import HeartbeatWatch
from winchkit.schema.bench import LimitSpec

__all__ = ["AxisPort", "Controller"]

_ENABLE_TIME = 2.0
_RESET_TIME = 1.0
_RUN_DOWN_MARGIN = 1.0
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

    def send(self, wish: Wish, *, velocity: float = 0.0, angle: float | None = None) -> int:
        """Send a command."""


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
        self.commanded = 0.0
        """Rope speed commanded last, m/s."""
        self._wanted: MotionSource | None = None
        self._ordered: Phase | None = None
        self._lock = threading.Lock()
        self._down = RunDown(rope, limits)
        self._angle = 0.0
        self._since = self._time = 0.0

    def begin(self, source: MotionSource) -> None:
        """Start a source, enabling the drive first where needed; replaces the one before."""
        with self._lock:
            self.done = self.stopped = False
            self.failure = ""
            self._wanted = source

    def run_down(self) -> None:
        """Ramp to rest, then disable."""
        self._order(Phase.RUN_DOWN)

    def stop(self) -> None:
        """Quick stop, then disable."""
        self._order(Phase.STOPPING)

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

    def _order(self, phase: Phase) -> None:
        with self._lock:
            if self._wanted is not None or (self.source is not None and not self.done):
                self.stopped = True
            self._wanted = None
            if self._ordered is not Phase.STOPPING:
                self._ordered = phase

    def _take_orders(self, now: float) -> None:
        with self._lock:
            ordered, self._ordered = self._ordered, None
            wanted, self._wanted = self._wanted, None
        if ordered is Phase.STOPPING:
            self._enter(Phase.STOPPING, now)
        elif ordered is Phase.RESETTING and self.phase is Phase.DISABLED:
            self._enter(Phase.RESETTING, now)
        elif ordered is Phase.RUN_DOWN and self.phase in (Phase.ENABLING, Phase.MOVING):
            self._begin_run_down(now)
        if wanted is not None:
            self._take(wanted, now)

    def _take(self, wanted: MotionSource, now: float) -> None:
        """Start a source now where that is smooth, else get ready for it and keep it."""
        feedback = self.axis.feedback
        if feedback is not None and self.phase in (Phase.MOVING, Phase.RUN_DOWN):
            if wanted.joins or self.commanded == 0.0:
                wanted.start(self._time, feedback.angle, self.commanded)
                self.source, self.done = wanted, False
                self.phase, self._since = Phase.MOVING, now
                return
            if self.phase is Phase.MOVING:
                self._begin_run_down(now)
        elif self.phase in (Phase.DISABLED, Phase.ENABLING):
            self.phase, self.source, self._since = Phase.ENABLING, wanted, now
            return
        with self._lock:
            self._wanted = self._wanted or wanted
            self.done = False

    def _enter(self, phase: Phase, now: float) -> None:
        self.phase, self._since = phase, now
        if phase in (Phase.STOPPING, Phase.DISABLED, Phase.RESETTING):
            self.source, self.commanded = None, 0.0
            self.done = self._wanted is None

    def _stay_disabled(self, now: float, feedback: AxisFeedback) -> None:
        self.axis.send(Wish.DISABLE)
        if feedback.state is State.OPERATION_ENABLED:
            self._enter(Phase.STOPPING, now)

    def _enable(self, now: float, feedback: AxisFeedback) -> None:
        if feedback.state is State.OPERATION_ENABLED and self.source is not None:
            self.source.start(self._time, feedback.angle, 0.0)
            self._angle = feedback.angle
            self._enter(Phase.MOVING, now)
            self._move(now, feedback)
            return
        self.axis.send(Wish.ENABLE)
        if now - self._since > _ENABLE_TIME:
            self.failure = f"the drive stays {feedback.state} for {_ENABLE_TIME:g} s"
            self._enter(Phase.STOPPING, now)

    def _move(self, now: float, feedback: AxisFeedback) -> None:
        if self.source is None or feedback.state is not State.OPERATION_ENABLED:
            self.failure = f"the drive went to {feedback.state} by itself"
            self._enter(Phase.STOPPING, now)
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
        self.axis.send(Wish.ENABLE, velocity=velocity, angle=target.angle)

    def _begin_run_down(self, now: float) -> None:
        self._down = RunDown(self.rope, self.limits)
        self._down.start(self._time, self._angle, self.commanded)
        self._enter(Phase.RUN_DOWN, now)
        self.source, self.done = None, True

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
