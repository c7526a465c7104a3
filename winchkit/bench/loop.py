"""The control loop: SYNC, newest feedback, supervision, motion, commands, once a cycle."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from winchkit.bench.parts import WinchParts, known, picture
from winchkit.bench.snapshot import BenchSnapshot, Phase, Trip
from winchkit.bench.supervisor import Supervisor, WinchInput
from winchkit.drivers.can.heartbeat import HeartbeatProducer, NmtState
from winchkit.drivers.clock import Clock
from winchkit.errors import ConnectionLost

__all__ = ["BusPort", "Callback", "ControlLoop"]

Callback = Callable[[BenchSnapshot], Mapping[str, float] | None]

_STOPPED = (Phase.DISABLED, Phase.STOPPING, Phase.RESETTING)
_DEAF = (
    "the drive does not heed the stop; the host's heartbeat is withheld, so that the watchdogs of "
    "all drives stop them; look at the drive before the reset"
)


class BusPort(Protocol):
    """What the loop needs of a CAN bus."""

    @property
    def fault(self) -> str | None:
        """Why it died."""

    def sync(self) -> None:
        """Send SYNC."""

    def heartbeat(self, node: int, state: int) -> None:
        """Send the host's heartbeat."""


class ControlLoop:
    """Runs ``step`` once a cycle on its own thread, or as its owner calls it in a test."""

    def __init__(
        self,
        buses: Sequence[tuple[BusPort, int, float]],
        winches: Mapping[str, WinchParts],
        supervisor: Supervisor,
        clock: Clock,
        cycle: float,
        *,
        stop_together: bool = True,
    ) -> None:
        """Take buses with the host's node id and heartbeat period, and winches by name.

        With ``stop_together`` all winches stop where the drive of one cannot go on.
        """
        self.winches = winches
        self.supervisor = supervisor
        self.callbacks: list[Callback] = []
        self.on_jog: Callable[[str, float], None] = lambda _name, _speed: None
        self.samplers: list[Callable[[BenchSnapshot], None]] = []
        self.failure: BaseException | None = None
        """What a callback, an effect of a profile or the loop itself raised."""
        self.snapshot: BenchSnapshot | None = None
        self.overruns = 0
        self.ordering = threading.Lock()
        """Hold it to order several winches: what is ordered under it takes effect in one cycle."""
        self.beating = True
        """Whether the host's heartbeat is sent."""
        self.listening = True
        """Whether it ends where a drive heeds no stop; not while drives are set up anew."""
        self._stop_together = stop_together
        self._buses = [(bus, node, HeartbeatProducer(period)) for bus, node, period in buses]
        self.cycle = cycle
        """Period of control, s."""
        self._clock, self._count = clock, 0
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Start the thread."""
        self._thread = threading.Thread(target=self._run, name="control", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread; the drives notice by their heartbeat consumers."""
        self._stopping.set()
        if self._thread is not None:
            self._thread.join(timeout=2.0)

    @property
    def count(self) -> int:
        """Cycles so far."""
        return self._count

    @property
    def alive(self) -> bool:
        """Whether the thread runs."""
        return self._thread is not None and self._thread.is_alive()

    def step(self, now: float) -> BenchSnapshot:
        """One control cycle at ``now`` (s)."""
        self._count += 1
        self._listen_for_stops(now)
        self._send_sync(now)
        inputs = {name: known(parts, now, self._count) for name, parts in self.winches.items()}
        self._note_failed_ropes()
        blocked = self.supervisor.check(now, inputs)
        # Before anything is stopped: whoever sees a motion ended must see the trip that ended it.
        self.snapshot = snapshot = self._picture(now, inputs, blocked)
        self._ask_callbacks(snapshot)
        with self.ordering:
            reason = self._failing()
            if self.supervisor.tripped or self.failure is not None or reason:
                for parts in self.winches.values():
                    if parts.controller.phase not in _STOPPED:
                        parts.controller.stop(reason)
            self._command(now)
        for sample in self.samplers:
            sample(snapshot)
        return snapshot

    def _listen_for_stops(self, now: float) -> None:
        """Fall silent where a drive does not heed a stop: its own watchdog is what is left."""
        if not (self.beating and self.listening):
            return
        for name, parts in self.winches.items():
            if parts.controller.unheeded(now):
                self.beating = False
                self.supervisor.latch(Trip("deaf", name, _DEAF, latches=True))

    def _note_failed_ropes(self) -> None:
        """A rope whose effects fail is known no better than it was: everything stops."""
        for parts in self.winches.values():
            self.failure = self.failure or parts.rope.failure

    def _failing(self) -> str:
        """Which winch must go down because its drive could not go on, and why, in words."""
        new = {name: parts.controller.new_failure() for name, parts in self.winches.items()}
        words = "; ".join(f"winch {name}: {failure}" for name, failure in new.items() if failure)
        return words if self._stop_together else ""

    def _run(self) -> None:
        due = self._clock.now()
        try:
            while not self._stopping.is_set():
                self.step(self._clock.now())
                due += self.cycle
                late = self._clock.now() - due
                if late > self.cycle:
                    self.overruns += 1
                    due += late
                self._clock.sleep(due - self._clock.now())
        except BaseException as error:  # noqa: BLE001 - kept, and raised in the owner's thread
            self.failure = error

    def _send_sync(self, now: float) -> None:
        for parts in self.winches.values():
            parts.axis.begin_cycle(self._count, now)
        for bus, node, producer in self._buses:
            try:
                bus.sync()
                if producer.due(now) and self.beating:
                    bus.heartbeat(node, NmtState.OPERATIONAL)
            except ConnectionLost as error:
                self._latch_bus(error)
            if bus.fault:
                self._latch_bus(ConnectionLost(f"CAN bus: {bus.fault}; reset opens it again"))

    def _command(self, now: float) -> None:
        for parts in self.winches.values():
            try:
                parts.controller.step(now, self._count * self.cycle)
            except ConnectionLost as error:
                self._latch_bus(error)

    def _latch_bus(self, error: ConnectionLost) -> None:
        self.supervisor.latch(Trip("bus", "", str(error), latches=True))

    def _ask_callbacks(self, snapshot: BenchSnapshot) -> None:
        """Let the user's functions see the cycle; speeds that they return are a live dead-man."""
        for callback in list(self.callbacks):
            try:
                for name, speed in (callback(snapshot) or {}).items():
                    self.on_jog(name, speed)
            except BaseException as error:  # noqa: BLE001 - kept, and raised in the owner's thread
                self.callbacks.remove(callback)
                self.failure = error

    def _picture(
        self, now: float, inputs: Mapping[str, WinchInput], blocked: tuple[Trip, ...]
    ) -> BenchSnapshot:
        return BenchSnapshot(
            time=now,
            cycle=self._count,
            winch={name: picture(parts, inputs[name], now) for name, parts in self.winches.items()},
            tripped=self.supervisor.tripped,
            blocked=blocked,
            overruns=self.overruns,
        )
