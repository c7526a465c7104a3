"""One winch in the control loop: the requested power state and setpoint of its drive in a cycle."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass

from winchkit.bench.control.cable import CableMap
from winchkit.bench.control.motion import (
    Held,
    MotionSource,
    PathStop,
    RunDown,
    Setpoint,
    StartGate,
    Stop,
    commanded_and_moved,
)
from winchkit.bench.control.snapshot import Phase
from winchkit.bench.control.stop_escalation import StopEscalation, StopEvidence, StopMethod
from winchkit.drivers.can.canopen.nmt import NmtState
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.cia402.feedback import AxisFeedback
from winchkit.drivers.can.cia402.state_machine import (
    ENABLE_OPERATION,
    POWERED,
    DriveState,
    RequestedState,
    has_left,
)
from winchkit.schema.bench import LimitSpec

ENABLE_TIME = 2.0
"""s: drives take some tenths, and with a brake to open about one."""
_GATE_TIME = 5.0
"""Time for which an enabled drive waits for others that start with it, s."""
_RESET_TIME = 1.0
"""s: as a drive needs after a fault reset at commissioning; in a fault with a cause it stays there.
"""
_RUN_DOWN_MARGIN = 1.0
"""s beyond the planned ramp: the following error and the window of the standstill; then the quick
stop follows."""
_FRESH_SYNCS = 2
"""A status word of these SYNCs was sampled after the stop was sent."""
_UNSEEN_SYNCS = 5
"""Answers to SYNC that are missing before a drive's power state counts as unknown; single frames
get lost."""
_ASK_PERIOD = 0.05
"""Of the reads of an unknown power state by SDO, s: with the writes that follow, a drive that
somebody else enables is stopped well within 0.15 s, the longest a first stop may take."""
_TRANSFER_PAUSE = 1.0
"""Longest time between two requests of one SDO transfer, s: the usual time-out of a client. A frame
from here in between would abort the transfer, which may be that of a firmware."""
_LEAST_WAY = 1e-3
"""Commanded way (m of cable) of which the motor has to turn half: static friction in a velocity
loop, and a position loop's last error, are below."""
_CORRECTED = 0.2
"""Share of limits.speed by which a lag behind the motion is made up at most: less than what trips
as a deviation, so that targets that were lost and come again move nothing by surprise."""
_MOVING = Phase.MOVING
_FOLLOWING = (_MOVING, Phase.RUN_DOWN)
_OPERATION_ENABLED = DriveState.OPERATION_ENABLED
_ENABLE, _DISABLE = RequestedState.ENABLE, RequestedState.DISABLE


@dataclass(frozen=True)
class _Order:
    """A requested motion."""

    source: MotionSource
    gate: StartGate | None

    def may_start(self, time: float) -> bool:
        """Whether the drive may start in this cycle without waiting for others."""
        return self.gate is None or self.gate.open(time)


class Controller:
    """Phases from disabled over moving back; what a thread orders takes effect in the next step."""

    def __init__(self, axis: Cia402Axis, cable: CableMap, limits: LimitSpec) -> None:
        self.axis = axis
        self.cable = cable
        self.limits = limits
        self.phase = Phase.DISABLED
        self.source: MotionSource | None = None
        self.done = True
        """Whether the last source has finished."""
        self.failure = ""
        """Fault of the drive that ended the last source; empty without one."""
        self.stopped = False
        """Whether a stop ended the last source before its end."""
        self.reason = ""
        """Reason of that stop, where another winch caused it."""
        self.commanded = 0.0
        """Winding speed commanded last, m/s."""
        self._velocity = 0.0
        self.uncommanded = ""
        """Change of the power state without a command; taken once by the control loop."""
        self.escalation = StopEscalation()
        self._wanted: _Order | None = None
        self._begun: _Order | None = None
        self._ordered: Phase | None = None
        self._lock = threading.Lock()
        self._down: Stop = RunDown(cable, limits)
        self._angle = 0.0
        self._held: float | None = None
        self._origin = 0.0
        """Motor angle at which the source began, rad."""
        self._reported = True
        self._since = self._time = 0.0
        self._word = 0
        self._sync = self._stop_sync = 0
        self._asked: float | None = None
        """Time of the SDO request for the power state, while no answer to SYNC shows it."""
        self._words_elsewhere = 0
        """Writes of 6040h by other SDO clients that were dealt with."""

    def new_failure(self) -> str:
        """Why the drive could not go on, returned once; empty where it could."""
        reported, self._reported = self._reported, True
        return "" if reported else self.failure

    def begin(self, source: MotionSource, gate: StartGate | None = None) -> None:
        """Start a source, enabling the drive first where needed; it waits enabled for the gate."""
        with self._lock:
            self.done = self.stopped = False
            self.failure = self.reason = ""
            self._wanted = _Order(source, gate)

    def ready_for(self, source: MotionSource) -> bool:
        """Whether the drive is enabled, at rest, and waits for nothing but this source."""
        feedback = self.axis.feedback
        if feedback is None or feedback.state is not DriveState.OPERATION_ENABLED:
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

    @property
    def silent(self) -> bool:
        """Whether nothing is left to stop this drive but its own host-loss reaction."""
        return self.escalation.method is StopMethod.SILENCE

    @property
    def pending(self) -> bool:
        """Whether a requested motion has not started yet."""
        return self._wanted is not None

    @property
    def follows(self) -> bool:
        """Whether the drive is to follow the commanded speed in this cycle."""
        return self.phase in _FOLLOWING and not self.axis.moves_alone

    def way(self, angle: float, arm: float) -> tuple[float, float]:
        """Cable commanded and moved since the source began, m, positive wound in; arm in m/rad."""
        return (self._angle - self._origin) * arm, (angle - self._origin) * arm

    def tracking(self, angle: float, arm: float) -> tuple[float, float]:
        """Value that the drive, at a motor angle (rad), is compared with while it :attr:`follows`.

        The winding speed of the velocity target sent last (m/s, NaN where the drive has none:
        position targets that are lost leave it at the last of them), and target less measured
        position in cable (m, zero unless it is position-controlled); ``arm`` in m/rad.
        """
        if self.axis.position_mode:
            return math.nan, (self._angle - angle) * arm
        return self._velocity * arm, 0.0

    def take_uncommanded(self) -> str:
        """Change of the power state without a command, returned once."""
        words, self.uncommanded = self.uncommanded, ""
        return words

    def step(self, now: float, time: float, sync: int = 0) -> None:
        """Send this cycle's command; ``time`` is that of motion, ``sync`` counts the SYNCs sent."""
        self._time, self._sync = time, sync
        # As in most cycles nothing was ordered; what is ordered meanwhile is taken in the next.
        if self._ordered is not None or self._wanted is not None:
            self._take_orders(now)
        feedback = self.axis.feedback
        if feedback is None:
            return
        phase = self.phase
        if phase is _MOVING:
            self._move(now, feedback)
            return
        match phase:
            case Phase.DISABLED:
                self._stay_disabled(now, feedback)
            case Phase.ENABLING:
                self._enable(now, feedback)
            case Phase.RUN_DOWN:
                self._slow_down(now, feedback)
            case Phase.STOPPING:
                self._stop(now, feedback)
            case Phase.RESETTING:
                self._reset(now, feedback)

    def settle(self) -> None:
        """Follow the drive's state without commanding it, after the control loop has failed."""
        feedback = self.axis.feedback
        self.source, self.commanded, self.done = None, 0.0, True
        self.escalation.end()
        rests = feedback is not None and feedback.state not in POWERED and self.axis.at_rest
        self.phase = Phase.DISABLED if rests else Phase.STOPPING

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
        # What is being enabled does not move yet, and may not have shown that it is enabled.
        enabling = ordered is Phase.RUN_DOWN and self.phase is Phase.ENABLING
        if ordered is Phase.STOPPING or enabling:
            self._enter(Phase.STOPPING, now)
        elif ordered is Phase.RESETTING and self.phase is Phase.DISABLED:
            self._enter(Phase.RESETTING, now)
        elif ordered is Phase.RUN_DOWN and self.phase is Phase.MOVING:
            self._begin_run_down(now)
        elif ordered is Phase.RUN_DOWN and self.phase is Phase.DISABLED:
            self.done = wanted is None
        if wanted is not None and self._take(wanted, now):
            with self._lock:
                if self._wanted is wanted:
                    self._wanted = None

    def _take(self, wanted: _Order, now: float) -> bool:
        """Start a source now where that is smooth, else get ready for it; whether it is taken."""
        feedback = self.axis.feedback
        if self.phase is Phase.RUN_DOWN and not _keeps_enabled(self._word):
            return False  # the ramp became a quick stop, which ends before anything moves again
        if feedback is not None and self.phase in (Phase.MOVING, Phase.RUN_DOWN):
            if wanted.source.joins or self.commanded == 0.0:
                if not wanted.may_start(self._time):
                    return False
                wanted.source.start(self._time, feedback.angle, self.commanded)
                self._origin = feedback.angle
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
        if phase is Phase.STOPPING and self.phase is not Phase.STOPPING:
            self.escalation.begin(now, nmt=self.axis.stops_on_nmt)
            self._stop_sync = self._sync
        self.phase, self._since = phase, now
        if phase in (Phase.STOPPING, Phase.DISABLED, Phase.RESETTING):
            self.source, self.commanded, self._velocity = None, 0.0, 0.0
            self.done = self._wanted is None

    def _fail(self, reason: str, now: float) -> None:
        self.failure, self._reported = reason, False
        self._enter(Phase.STOPPING, now)

    def _stay_disabled(self, now: float, feedback: AxisFeedback) -> None:
        if feedback.state is _OPERATION_ENABLED or self._enabled_unseen(now, feedback):
            self.uncommanded = "the drive was enabled without a command from here"
            self._enter(Phase.STOPPING, now)
            self._stop(now, feedback)
            return
        self._word = self.axis.send(_DISABLE)

    def _enabled_unseen(self, now: float, feedback: AxisFeedback) -> bool:
        """Whether a drive that answers no SYNC shows by SDO that it is in operation enabled.

        Somebody else may enable it while it is pre-operational. It is quick-stopped by SDO, and its
        status word is read again and again: not during an SDO transfer of somebody else, of which a
        write of 6040h is answered by a quick stop at once.
        """
        axis = self.axis
        words, self._words_elsewhere = self._words_elsewhere, axis.second_master.control_words
        if axis.operational and self._sync - feedback.sync <= _UNSEEN_SYNCS:
            if self._asked is not None:
                self._asked = None
                axis.sdo_stop.end()
            return False
        if axis.sdo_stop.state is DriveState.OPERATION_ENABLED:
            self._asked = None
            axis.sdo_stop.end()
            return True
        if words != self._words_elsewhere:
            axis.sdo_stop.end()  # what is sent next is the quick stop again, and no further read
        elif (self._asked is not None and now - self._asked < _ASK_PERIOD) or (
            now - axis.second_master.last_request < _TRANSFER_PAUSE
        ):
            return False
        if heard_by_sdo(axis.nmt_text):
            self._asked = now
            axis.sdo_stop.send()
        return False

    def _leave(self, now: float, feedback: AxisFeedback) -> None:
        """The drive has left operation enabled although it was commanded to stay."""
        self.uncommanded = (
            f"the drive left operation enabled without a command from here and is now "
            f"{feedback.state} (STO or enable input, another master, or the drive itself)"
        )
        self._fail(self.uncommanded, now)
        self._stop(now, feedback)

    def _enable(self, now: float, feedback: AxisFeedback) -> None:
        source: object = self.source
        if isinstance(source, Held) and not source.dead_man.live(now):
            # The permission has expired meanwhile: the drive is not enabled for it.
            self._enter(Phase.STOPPING, now)
            self._stop(now, feedback)
            return
        enabled = feedback.state is DriveState.OPERATION_ENABLED
        if enabled and self._begun is not None and self._begun.may_start(self._time):
            self._begun.source.start(self._time, feedback.angle, 0.0)
            self._angle = self._origin = feedback.angle
            self._enter(Phase.MOVING, now)
            self._move(now, feedback)
            return
        if self._held is not None and not enabled:
            self._leave(now, feedback)
            return
        if enabled and self._held is None:
            self._held = feedback.angle
        self._word = self.axis.send(RequestedState.ENABLE, angle=self._held)
        if now - self._since > (_GATE_TIME if enabled else ENABLE_TIME):
            waiting = "waits for a winch that was to start with it"
            stays = f"the drive stays {feedback.state} for {ENABLE_TIME:g} s"
            self._fail(waiting if enabled else stays, now)

    def _move(self, now: float, feedback: AxisFeedback) -> None:
        source = self.source
        if source is None or feedback.state is not _OPERATION_ENABLED:
            self._leave(now, feedback)
            return
        target = source.target(self._time, feedback.angle, now)
        self._follow(target, feedback)
        if target.done:
            self._compare_way(target, feedback)
            self.done = True
            if not source.holds:
                self._begin_run_down(now)

    def _compare_way(self, target: Setpoint, feedback: AxisFeedback) -> None:
        """Note the failure of a motor that has not turned as commanded, however slowly."""
        if target.angle is None or not self.follows:
            return
        asked, moved = self.way(feedback.angle, self.cable.at(feedback.angle)[1])
        if abs(asked) > _LEAST_WAY and math.copysign(1.0, asked) * moved < abs(asked) / 2:
            self._reported = False
            self.failure = (
                f"{commanded_and_moved(asked, moved)}; check brake, load and drive limits"
            )

    def _follow(self, target: Setpoint, feedback: AxisFeedback) -> None:
        velocity, angle, winding_speed, _, start = target
        arm = self.cable.at(feedback.angle)[1]
        fastest, planned = self.limits.speed / abs(arm), winding_speed / arm
        most = _CORRECTED * fastest
        if not abs(velocity - planned) <= most:
            velocity = planned + max(-most, min(most, velocity - planned))
        if not abs(velocity) <= fastest:
            velocity = max(-fastest, min(fastest, velocity))
        self._velocity, self.commanded = velocity, winding_speed
        if angle is not None:
            self._angle = angle
        self._word = self.axis.send(_ENABLE, velocity=velocity, angle=angle, start=start)

    def _begin_run_down(self, now: float) -> None:
        source: object = self.source
        if isinstance(source, PathStop):
            self._down = source.run_down()
        else:
            self._down = RunDown(self.cable, self.limits)
        self._down.start(self._time, self._angle, self.commanded)
        self._enter(Phase.RUN_DOWN, now)
        self.source, self.done = None, self._wanted is None

    def _slow_down(self, now: float, feedback: AxisFeedback) -> None:
        target = self._down.target(self._time, feedback.angle, now)
        self.commanded = target.winding_speed
        left = feedback.state is not DriveState.OPERATION_ENABLED
        if left and _keeps_enabled(self._word):
            self._leave(now, feedback)
            return
        late = now - self._since > self._down.duration + _RUN_DOWN_MARGIN
        settled = target.done and self.axis.at_rest and self._wanted is None
        if settled or late or left:
            self._enter(Phase.STOPPING, now)
            self._stop(now, feedback)
            return
        self._angle = target.angle if target.angle is not None else self._angle
        self._velocity = target.velocity
        self._word = self.axis.send(
            RequestedState.RUN_DOWN, velocity=target.velocity, angle=target.angle
        )

    def _stop(self, now: float, feedback: AxisFeedback) -> None:
        self._word = self.axis.send(RequestedState.DISABLE)
        sampled = feedback.sync > self._stop_sync
        if self.escalation.method is not None:
            self._escalate(now, feedback)
        elif (sampled and feedback.state is DriveState.OPERATION_ENABLED) or self._enabled_unseen(
            now, feedback
        ):
            self.uncommanded = "the drive was enabled while it was being stopped"
            self.axis.sdo_stop.end()
            self._stop_sync = self._sync
            self.escalation.begin(now, nmt=self.axis.stops_on_nmt)
        if sampled and feedback.state not in POWERED and self.axis.at_rest:
            self.escalation.end()
            self.axis.sdo_stop.end()
            self._enter(Phase.DISABLED, now)

    def _escalate(self, now: float, feedback: AxisFeedback) -> None:
        """Use the way to stop that is due in this cycle."""
        axis = self.axis
        fresh = feedback.sync > self._stop_sync and feedback.sync >= self._sync - _FRESH_SYNCS
        left = fresh and has_left(feedback.state)
        by_sdo = axis.sdo_stop.state
        left = left or (by_sdo is not None and has_left(by_sdo))
        if self.escalation.method is StopMethod.NMT:
            left = left or not heard_by_sdo(axis.nmt_text)
        answers = heard_by_sdo(axis.nmt_text) and not axis.sdo_stop.refused
        method = self.escalation.step(now, StopEvidence(left, axis.operational, answers))
        if method is StopMethod.SDO:
            axis.sdo_stop.send()
        elif method is StopMethod.NMT:
            axis.stop_by_nmt()

    def _reset(self, now: float, feedback: AxisFeedback) -> None:
        self._word = self.axis.send(RequestedState.RESET)
        if feedback.state is not DriveState.FAULT or now - self._since > _RESET_TIME:
            self._enter(Phase.DISABLED, now)


def _keeps_enabled(word: int) -> bool:
    """Whether a control word keeps a drive in operation enabled."""
    return word & ENABLE_OPERATION == ENABLE_OPERATION


def heard_by_sdo(nmt: str) -> bool:
    """Whether a drive in this NMT state answers SDOs: in all but stopped (CiA 301)."""
    return nmt != str(NmtState.STOPPED)
