"""The control loop: SYNC, newest feedback, supervision, motion, commands, once a cycle."""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from winchkit.bench.control.observation import WinchInput
from winchkit.bench.control.snapshot import BenchSnapshot, Direction, Phase, Trip, WinchSnapshots
from winchkit.bench.control.standstill import StandstillCause
from winchkit.bench.control.supervisor import Supervisor
from winchkit.bench.control.winch_state import WinchParts, known, pictures
from winchkit.bench.records.latch import LatchFile
from winchkit.bench.records.position_file import PositionFile
from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.canopen.nmt import HeartbeatProducer, NmtState
from winchkit.drivers.can.cia402.motor_position import KeptPosition
from winchkit.drivers.can.cia402.state_machine import DriveState
from winchkit.drivers.clock import Clock
from winchkit.drivers.scheduling import Scheduler, Thread, event_of, thread_of
from winchkit.errors import ConnectionLost, MotionError, UsageError, WinchkitError

Callback = Callable[[BenchSnapshot], Mapping[str, float] | None]

_LOGGER = logging.getLogger(__name__)
_STOPPED = (Phase.DISABLED, Phase.STOPPING, Phase.RESETTING)
_UNRESPONSIVE = (
    "the drive does not obey the stop, neither by RPDO nor by SDO; the host's heartbeat is "
    "withheld, so that the watchdogs of all drives stop them; look at the drive before the reset"
)
_DRIVES_NOTICE = 1.25
"""Of the longest gap, which is 2 heartbeats: 2.5 after the last one the drives count the host as
lost."""
_LATE = 5
"""Cycles within which the frames that wait after a longer gap are read."""
_TENTHS = 30
"""Bins of the histogram of cycle times, each a tenth of the period wide."""
_ANEW = 0.1
"""A judgement is put off once in this time at most, s."""
_HEARD_WITHIN = 0.1
"""After the control loop has failed, drives that are still enabled then are left to silence, s."""


class ControlLoop:
    """Runs ``step`` once a cycle on its own thread, or as its owner calls it in a test."""

    def __init__(
        self,
        buses: Sequence[tuple[CanBus, int, float]],
        winches: Mapping[str, WinchParts],
        supervisor: Supervisor,
        clock: Clock,
        cycle: float,
        *,
        stop_together: bool = True,
        latch: LatchFile | None = None,
        positions: PositionFile | None = None,
        longest_gap: float = math.inf,
    ) -> None:
        """Take buses with the host's node id and heartbeat period; at most ``longest_gap`` (s)."""
        self.winches = winches
        self.supervisor = supervisor
        self.callbacks: list[Callback] = []
        self.on_jog: Callable[[str, float], None] = lambda _name, _winding_speed: None
        self.samplers: list[Callable[[BenchSnapshot], None]] = []
        self.failure: BaseException | None = None
        """Exception of a callback or of an effect of a profile."""
        self.broken: BaseException | None = None
        """Exception of the loop itself, which sends stops only from then on."""
        self.snapshot: BenchSnapshot | None = None
        self.thread_id = 0
        """Native id of the control thread, once it runs."""
        self.overruns = 0
        """Periods in which no cycle began."""
        self.cycle_counts = [0] * (_TENTHS + 1)
        """Cycles by the time since the one before: each count is for a tenth of the period, the
        last one for everything longer."""
        self.ordering = threading.Lock()
        """Hold it to order several winches: what is ordered under it takes effect in one cycle."""
        self.beating = True
        """Whether the host's heartbeat is sent."""
        self.listening = True
        """Whether the heartbeat ends where a drive obeys no stop; not while drives are set up."""
        self._sync_watched = False
        """Whether a drive that is to notice the silence does so by the loss of SYNC."""
        self._stop_together = stop_together
        self._buses = [(bus, node, HeartbeatProducer(period)) for bus, node, period in buses]
        self.cycle = cycle
        """Period of control, s."""
        self._clock, self._count = clock, 0
        self._latch = latch or LatchFile("")
        self._positions = positions or PositionFile("")
        self._marks: list[tuple[bool, tuple[int, int, str, bool]]] = []
        """What of the record of positions was written last."""
        self._motion_time = 0.0
        self._kept: tuple[Trip, ...] = supervisor.tripped
        self._longest_gap = longest_gap
        self._before = self._ended = math.nan
        self._cause = StandstillCause(counted=not isinstance(clock, Scheduler))
        self._resumed = self._catching_up = -math.inf
        self._broken_at = math.inf
        self._warnings: dict[str, Trip] = {}
        self._stopping = event_of(clock)
        self._asking: int | None = None
        """Thread that is in a function of :attr:`callbacks` just now."""
        self._thread: Thread | None = None

    def start(self) -> None:
        """Start the thread."""
        self._thread = thread_of(self._clock, self._run, "control")
        self._thread.start()

    def close(self) -> None:
        """End the thread; the drives notice by their heartbeat consumers."""
        self._stopping.set()
        if self._thread is not None:
            self._thread.join(timeout=2.0)

    @property
    def asks_here(self) -> bool:
        """Whether this thread is in a function that the control loop has called and waits for."""
        return self._asking == threading.get_ident()

    def require_other_thread(self, call: str) -> None:
        """Raise UsageError where this thread is in a function that the control loop waits for."""
        if self.asks_here:
            raise UsageError(
                f"{call} waits for the control loop, and was called in an on_cycle function, for "
                "which the loop waits; there return winding speeds, call stop_now() or what takes "
                "wait=False, and call everything else from another thread"
            )

    @property
    def count(self) -> int:
        """Number of cycles."""
        return self._count

    @property
    def alive(self) -> bool:
        """Whether the thread runs."""
        return self._thread is not None and self._thread.is_alive()

    def step(self, now: float, missed: int = 0) -> BenchSnapshot:
        """One control cycle at ``now`` (s), after ``missed`` periods in which none began."""
        self._count += 1
        self._motion_time += self.cycle * (1 + self._made_up(missed))
        self._watch_clock(now)
        self._listen_for_stops()
        self._send_sync(now)
        count = self._count
        resumed = now if now < self._catching_up else self._resumed
        inputs = {name: known(parts, now, count, resumed) for name, parts in self.winches.items()}
        self._note_failed_cables()
        blocked = self.supervisor.check(now, inputs)
        # Before anything is stopped: whoever sees a motion ended must see the trip that ended it.
        self.snapshot = snapshot = self._picture(now, inputs, blocked)
        self._ask_callbacks(snapshot)
        with self.ordering:
            reason = self._failing()
            if self.supervisor.tripped or self.failure is not None or reason:
                self._stop_all(reason)
            self._command(now)
        if self.supervisor.tripped is not self._kept:
            self._keep()
        self._keep_positions()
        self._sample(snapshot)
        return snapshot

    def restore(self, trips: Sequence[Trip], further: Sequence[Trip] = ()) -> None:
        """Latch the trips of the latch file, and ``further`` ones that are not in it yet."""
        for trip in trips:
            self.supervisor.latch(trip)
        self._kept = self.supervisor.tripped
        for trip in further:
            self.supervisor.latch(trip)

    def clear_latch(self) -> None:
        """Clear the acknowledged trips here and on disk; raises NotPermitted where that fails."""
        self._latch.clear()
        self.supervisor.clear()
        self._kept = ()

    def _stop_all(self, reason: str) -> None:
        """Stop every winch that moves or is to start."""
        for parts in self.winches.values():
            if parts.controller.phase not in _STOPPED or parts.controller.pending:
                parts.controller.stop(reason)

    def _watch_clock(self, now: float) -> None:
        """Recognise a standstill of this computer by its own clock, before anything is blamed."""
        gap, self._before = now - self._before, now
        if gap >= 0:
            self.cycle_counts[min(int(10 * gap / self.cycle), _TENTHS)] += 1
        late = gap > _LATE * self.cycle
        if late and now > self._catching_up + _ANEW:
            # Frames that came meanwhile are read first: until then no silence is judged.
            self._catching_up = now + _LATE * self.cycle
        if not (gap > self._longest_gap or gap < 0):
            self._cause.note(now)
            return
        self._resumed = now
        cause = self._cause.explain(now, gap, between=now - self._ended)
        moving = any(p.controller.phase not in _STOPPED for p in self.winches.values())
        silence = max((now - each.last for _, _, each in self._buses), default=gap)
        if moving or gap < 0 or silence > _DRIVES_NOTICE * self._longest_gap:
            self.supervisor.latch(
                Trip(
                    "computer",
                    "",
                    f"this computer stood still for {gap:.2f} s (limit {self._longest_gap:.2f} s): "
                    f"{cause}; see 'A computer for a bench' in docs/realtime.md, then reset",
                    latches=True,
                )
            )

    def _made_up(self, missed: int) -> int:
        """Missed periods in which the motion went on: braking is not later because of them.

        A drive that follows positions has waited at its last one, and the motion waits with it.
        """
        if missed and any(parts.axis.position_mode for parts in self.winches.values()):
            return 0
        return missed

    def close_positions(self) -> None:
        """Write the positions of the drives at rest to the disk, before they are released."""
        self._positions.close_with(self._at_rest_or_open())

    def _at_rest_or_open(self) -> dict[str, KeptPosition]:
        found = {
            name: parts.axis.position.keep(closed=parts.controller.phase is Phase.DISABLED)
            for name, parts in self.winches.items()
        }
        return {name: kept for name, kept in found.items() if kept is not None}

    def _keep_positions(self) -> None:
        """Write the record of positions where a drive begins to be enabled, rests, or is lost."""
        marks = [
            (parts.controller.phase is Phase.DISABLED, parts.axis.position.mark)
            for parts in self.winches.values()
        ]
        if marks == self._marks:
            return
        positions = self._at_rest_or_open()
        problem = self._positions.keep(positions)
        if problem is not None:
            self.supervisor.latch(problem)
        if len(positions) == len(marks):  # else some have not answered yet
            self._marks = marks

    def _keep(self) -> None:
        """Write the latch to its file."""
        trips = self.supervisor.tripped
        problem = self._latch.keep(trips)
        if problem is not None:
            self.supervisor.latch(problem)
            trips = self.supervisor.tripped
        self._kept = trips

    def _sample(self, snapshot: BenchSnapshot) -> None:
        """Pass the cycle to the recorders; one that fails is a warning and no stop."""
        for sample in tuple(self.samplers):
            try:
                sample(snapshot)
            except Exception as error:
                if not isinstance(error, WinchkitError):  # else the recorder has said it
                    _LOGGER.exception("a recorder failed")
                self.warn(Trip("recorder", "", f"logging failed: {error}", Direction.NONE))
                self.samplers.remove(sample)

    def warn(self, warning: Trip) -> None:
        """Show a warning until the next reset."""
        self._warnings.setdefault(warning.kind, warning)

    def forget_warnings(self) -> None:
        """Clear the warnings at a reset."""
        self._warnings.clear()

    def _listen_for_stops(self) -> None:
        """End the heartbeat where a drive does not obey a stop: only its watchdog is left."""
        if not (self.beating and self.listening):
            return
        for name, parts in self.winches.items():
            if parts.controller.silent:
                self._fall_silent()
                self.supervisor.latch(Trip("unresponsive", name, _UNRESPONSIVE, latches=True))

    def _fall_silent(self) -> None:
        """Stop sending heartbeat and SYNC where drives supervise them."""
        self.beating = False
        watched = [each.axis.fall_silent() for each in self.winches.values()]
        self._sync_watched = any(watched)

    def _note_failed_cables(self) -> None:
        """A cable whose effects fail is known no better than it was: everything stops."""
        for parts in self.winches.values():
            self.failure = self.failure or parts.cable.failure

    def _failing(self) -> str:
        """Winches to stop because a drive could not continue, with the reason in words."""
        new = [
            Trip("motion", name, failure, Direction.NONE)
            for name, parts in self.winches.items()
            if (failure := parts.controller.new_failure())
        ]
        for each in new:
            self.warn(each)
        return "; ".join(map(str, new)) if self._stop_together else ""

    def _run(self) -> None:
        self.thread_id = threading.get_native_id()
        due = self._clock.now()
        while not self._stopping.is_set():
            now = self._clock.now()
            missed = max(0, int((now - due) / self.cycle))
            if missed:
                # They are left out and not made up for: no period has two SYNCs.
                self.overruns += missed
                due += missed * self.cycle
            if self.broken is None:
                try:
                    self.step(now, missed)
                except BaseException as error:  # noqa: BLE001 - named in a trip, everything stops
                    self.fail(error, now)
            else:
                self.stop_step(now)
            due += self.cycle
            self._ended = self._clock.now()
            self._clock.sleep(due - self._ended)

    def fail(self, error: BaseException, now: float) -> None:
        """Stop every drive from prepared frames, and do nothing else from now on."""
        self.broken, self._broken_at = error, now
        for parts in self.winches.values():
            _attempt(parts.axis.emergency_stop, sdo=False)
        for bus, _, _ in self._buses:
            _attempt(bus.sync)
        for parts in self.winches.values():
            _attempt(parts.axis.sdo_stop.send)
        _LOGGER.error("the control loop failed", exc_info=error)
        self.supervisor.latch(
            Trip(
                "loop",
                "",
                f"the control loop failed ({type(error).__name__}: {error}) and sends quick stops "
                "only; close the bench, report it if it is a defect, open it again and reset",
                latches=True,
            )
        )
        _attempt(self._keep)
        self._show_trips()

    def stop_step(self, now: float) -> None:
        """A cycle after the loop has failed: 02h, SYNC, and heartbeat if no drive stays enabled."""
        self._count += 1
        for parts in self.winches.values():
            _attempt(parts.axis.begin_cycle, self._count, now)
        for bus, node, producer in self._buses:
            if self.beating or not self._sync_watched:
                _attempt(bus.sync)
            if self.beating and producer.due(now):
                _attempt(bus.heartbeat, node, NmtState.OPERATIONAL)
        for parts in self.winches.values():
            if self.beating:
                _attempt(parts.axis.emergency_stop, sdo=False)
            _attempt(parts.controller.settle)
            if (
                parts.controller.phase is not Phase.DISABLED
                and now - self._broken_at < _HEARD_WITHIN
            ):
                _attempt(parts.axis.sdo_stop.send)
        rest = all(p.controller.phase is Phase.DISABLED for p in self.winches.values())
        if now - self._broken_at > _HEARD_WITHIN and not rest and not self._ramping():
            _attempt(self._fall_silent)
        self._show_trips()

    def _ramping(self) -> bool:
        """Whether every drive reports that it has left operation enabled."""
        said = [parts.axis.feedback for parts in self.winches.values()]
        return all(
            item is not None and item.state is not DriveState.OPERATION_ENABLED for item in said
        )

    def _show_trips(self) -> None:
        """Trips, phases and power states of now; what was measured before is not valid any more."""
        if self.snapshot is not None:
            winches = {}
            for name, item in self.snapshot.winch.items():
                parts = self.winches[name]
                state = "" if (said := parts.axis.feedback) is None else str(said.state)
                winches[name] = item.without_values(parts.controller.phase, state)
            self.snapshot = replace(
                self.snapshot, tripped=self.supervisor.tripped, winch=winches, cycle=self._count
            )

    def _send_sync(self, now: float) -> None:
        for parts in self.winches.values():
            parts.axis.begin_cycle(self._count, now)
        for bus, node, producer in self._buses:
            try:
                if self.beating or not self._sync_watched:
                    bus.sync()
                if producer.due(now) and self.beating:
                    bus.heartbeat(node, NmtState.OPERATIONAL)
            except ConnectionLost as error:
                self._latch_bus(error)
            if bus.fault:
                self._latch_bus(ConnectionLost(f"CAN bus: {bus.fault}; reset opens it again"))

    def _command(self, now: float) -> None:
        for bus, _, _ in self._buses:
            bus.gather()
        for name, parts in self.winches.items():
            try:
                parts.controller.step(now, self._motion_time, self._count)
            except ConnectionLost as error:
                self._latch_bus(error)
            except MotionError as error:
                # A target that the drive cannot take: stopped at once, by what needs no target.
                self.supervisor.latch(Trip("target", name, f"{error}; reset", latches=True))
                parts.controller.stop()
                parts.axis.emergency_stop(sdo=False)
        for bus, _, _ in self._buses:
            try:
                bus.send_gathered()
            except ConnectionLost as error:
                self._latch_bus(error)

    def _latch_bus(self, error: ConnectionLost) -> None:
        self.supervisor.latch(Trip("bus", "", str(error), latches=True))

    def _ask_callbacks(self, snapshot: BenchSnapshot) -> None:
        """Call the user's functions; the winding speeds that they return renew the dead-man."""
        self._asking = threading.get_ident()
        for callback in list(self.callbacks):
            try:
                for name, winding_speed in (callback(snapshot) or {}).items():
                    self.on_jog(name, winding_speed)
            except BaseException as error:  # noqa: BLE001 - kept, and raised in the owner's thread
                self.callbacks.remove(callback)
                self.failure = error
        self._asking = None

    def _picture(
        self, now: float, inputs: Mapping[str, WinchInput], blocked: tuple[Trip, ...]
    ) -> BenchSnapshot:
        taken = [
            (
                parts.controller.phase,
                parts.cable.correction,
                parts.commander,
                parts.axis.position.trim,
            )
            for parts in self.winches.values()
        ]
        return BenchSnapshot(
            now,
            self._count,
            WinchSnapshots(
                lambda: pictures(inputs, taken, now), lambda: [phase for phase, *_ in taken]
            ),
            self.supervisor.tripped,
            blocked,
            self.overruns,
            (*self._warnings.values(), *self.supervisor.warnings),
        )


def _attempt(action: Callable[..., object], *arguments: object, **options: object) -> None:
    """Do one part of a stop; its exception must not prevent the other parts."""
    try:
        action(*arguments, **options)
    except BaseException:
        _LOGGER.exception("a part of the stop failed")
