"""``with open_bench("bench.toml") as bench``: everything wired up, supervised and stopped again."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack, suppress
from pathlib import Path
from types import TracebackType
from typing import Self

from winchkit.bench.loop import Callback, ControlLoop
from winchkit.bench.owner import Ownership
from winchkit.bench.recorder import Recorder
from winchkit.bench.snapshot import BenchSnapshot, Direction, Phase
from winchkit.bench.winch import Winch
from winchkit.bench.wiring import Wired, wire
from winchkit.drivers.clock import Clock, MonotonicClock
from winchkit.drivers.modbus.instrument import Instrument
from winchkit.errors import (
    ConnectionLost,
    DriveFault,
    LimitTripped,
    MotionError,
    NoReply,
    NotPermitted,
    UsageError,
    WinchkitError,
)
from winchkit.schema.bench import BenchSpec
from winchkit.units import suggest

__all__ = ["Bench", "open_bench"]

_POLL = 0.01
_FIRST_FEEDBACK = 2.0
_FIRST_READING = 1.5
_REST_TIME = 5.0
_RELEASE = 0.5
_RESET_TIME = 2.0


class Bench:
    """An open bench; this process owns it until it is closed."""

    def __init__(self, spec: BenchSpec, clock: Clock) -> None:
        """Use :func:`open_bench`. Raises every error of opening, with nothing left open."""
        self.spec = spec
        self.clock = clock
        self._recorders: list[Recorder] = []
        self._released = float("-inf")
        with ExitStack() as stack:
            stack.callback(Ownership(spec).close)
            self._wired: Wired = wire(spec, clock, stack)
            self.loop: ControlLoop = self._wired.loop
            self.winch: dict[str, Winch] = {
                name: Winch(self, name, spec.winch[name], parts, dict(self._wired.sensors[name]))
                for name, parts in self.loop.winches.items()
            }
            self.loop.on_jog = self._jog_from_callback
            stack.callback(self.loop.close)
            self.loop.start()
            self._await_feedback()
            self._await_sensors()
            self._stack = stack.pop_all()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()
        if error is None and self.loop.failure is not None:
            raise self.loop.failure

    @property
    def snapshot(self) -> BenchSnapshot:
        """Newest picture of the whole bench."""
        assert self.loop.snapshot is not None, "an open bench has had a cycle"
        return self.loop.snapshot

    def on_cycle(self, callback: Callback) -> Callable[[], None]:
        """Call a function with every cycle's snapshot, on the control thread.

        It may return rope speeds by winch (m/s, positive winds in), which move these winches for
        as long as it keeps returning them. Should it raise, everything stops and the exception
        comes out of the ``with`` block. Returns a function that takes it off again.
        """
        self.loop.callbacks.append(callback)

        def remove() -> None:
            with suppress(ValueError):
                self.loop.callbacks.remove(callback)

        return remove

    def stop(self, *, wait: bool = True) -> None:
        """Ramp every winch to rest, then disable. Always allowed."""
        for winch in self.winch.values():
            winch.stop(wait=False)
        if wait:
            self.wait_at_rest(self.winch)

    def stop_now(self, *, wait: bool = True) -> None:
        """Quick-stop every winch. Whoever still holds a jog must let go before the next one."""
        self._released = self.clock.now() + _RELEASE
        for parts in self.loop.winches.values():
            parts.controller.stop()
        if wait:
            self.wait_at_rest(self.winch)

    def reset(self) -> None:
        """Clear trips and drive faults; drives that lost their set-up are commissioned again.

        Nothing is enabled by it. Raises LimitTripped naming what still forbids any motion.
        """
        self.wait_at_rest(self.winch)
        tripped = {(trip.kind, trip.winch) for trip in self.snapshot.tripped}
        for name, axis in self._wired.axes.items():
            if {("boot-up", name), ("heartbeat", name), ("nmt", name), ("mode", name)} & tripped:
                axis.commission()
        self._await_feedback()
        self._clear_faults()
        beats = {name: axis.heartbeat.boot_ups for name, axis in self._wired.axes.items()}
        self.loop.supervisor.reset(beats)
        self._await_cycles(3)
        still = [trip for trip in self.snapshot.blocked if trip.blocks is Direction.BOTH]
        if still:
            raise LimitTripped("still not free to move: " + "; ".join(map(str, still)))

    def log(self, path: str | Path, metadata: Mapping[str, str] | None = None) -> Recorder:
        """Start logging to a file; ``with bench.log("lift.csv"):`` ends it."""
        recorder = Recorder(
            path,
            {name: winch.sensors for name, winch in self.winch.items()},
            self.clock,
            {**self._wired.metadata, **(metadata or {})},
            self._stop_feeding,
        )
        self._recorders.append(recorder)
        self.loop.samplers.append(recorder.feed)
        return recorder

    def close(self) -> None:
        """Stop every winch in a controlled way and let the buses go. Twice does no harm."""
        with self._stack:
            if self.loop.alive:
                self._come_to_rest()
                self._wired.disarm()
            for recorder in tuple(self._recorders):
                recorder.close()
        self._stack = ExitStack()

    def permit(self, winch: str, direction: Direction) -> None:
        """Raise what forbids this motion now; returns when it is allowed."""
        if not direction:
            return
        self.raise_trouble()
        now = self.clock.now()
        if now < self._released:
            self._released = now + _RELEASE
            raise NotPermitted(
                f"winch {winch} was stopped by an operator; let go before moving it again"
            )
        for trip in self.snapshot.blocked:
            if trip.blocks is Direction.BOTH or (trip.winch == winch and trip.blocks & direction):
                raise NotPermitted(str(trip))

    def raise_trouble(self) -> None:
        """Raise what has stopped the bench, if anything has."""
        if self.loop.failure is not None:
            raise self.loop.failure
        if not self.loop.alive:
            raise ConnectionLost("the control loop has ended; open the bench again")
        tripped = self.snapshot.tripped
        if tripped:
            words = "; ".join(map(str, tripped))
            kind = DriveFault if tripped[0].kind == "fault" else LimitTripped
            raise kind(f"{words} (latched: all winches were stopped; reset to go on)")

    def wait_at_rest(self, names: Iterable[str]) -> None:
        """Return when these winches are disabled and stand still; raises MotionError if not."""
        deadline = self.clock.now() + _REST_TIME
        controllers = {name: self.loop.winches[name].controller for name in names}
        self._await_cycles(2)
        while True:
            seen = self.snapshot.winch
            busy = [
                name
                for name, item in controllers.items()
                if item.phase is not Phase.DISABLED or seen[name].phase is not Phase.DISABLED
            ]
            if not busy or not self.loop.alive:
                return
            if self.clock.now() > deadline:
                for name in busy:
                    controllers[name].stop()
                state = self.snapshot.winch[busy[0]].state
                raise MotionError(
                    f"winch {busy[0]} did not come to rest within {_REST_TIME:g} s "
                    f"(drive: {state}); use the emergency stop and look at the drive"
                )
            self.clock.sleep(_POLL)

    def command(self, instrument: Instrument, name: str) -> None:
        """Send a command of its device file to an instrument."""
        self._wired.command(instrument, name)

    def named(self, name: str | None) -> Winch:
        """A winch by name, or the only one; raises UsageError."""
        if name is None and len(self.winch) == 1:
            return next(iter(self.winch.values()))
        known = list(self.winch)
        if name not in self.winch:
            what = f"no winch '{name}'" if name else "which winch?"
            raise UsageError(f"{what}; it has {', '.join(known)}" + suggest(name or "", known))
        return self.winch[name]

    def _jog_from_callback(self, name: str, speed: float) -> None:
        try:
            self.named(name).jog(speed)
        except MotionError:
            if not self.snapshot.tripped:
                raise

    def _stop_feeding(self, recorder: Recorder) -> None:
        if recorder in self._recorders:
            self._recorders.remove(recorder)
            self.loop.samplers.remove(recorder.feed)

    def _come_to_rest(self) -> None:
        """Ramp down; what does not come to rest gets a quick stop."""
        try:
            self.stop()
        except MotionError:
            self.stop_now(wait=False)
            self._await_cycles(50)

    def _clear_faults(self) -> None:
        for parts in self.loop.winches.values():
            parts.controller.reset()
        self._await_cycles(3)
        deadline = self.clock.now() + _RESET_TIME
        while self.clock.now() < deadline:
            if all(p.controller.phase is not Phase.RESETTING for p in self.loop.winches.values()):
                return
            self.clock.sleep(_POLL)

    def _await_feedback(self) -> None:
        """Wait until every drive answers to SYNC."""
        deadline = self.clock.now() + _FIRST_FEEDBACK
        for name, axis in self._wired.axes.items():
            while axis.feedback is None or self.loop.snapshot is None:
                if self.loop.failure is not None:
                    raise self.loop.failure
                if self.clock.now() > deadline:
                    raise NoReply(
                        f"winch {name} ({axis.name}): the drive answers SDO but sends no PDOs on "
                        f"SYNC within {_FIRST_FEEDBACK:g} s; check its PDO mapping and SYNC id 80h"
                    )
                self.clock.sleep(_POLL)
        self._await_cycles(2)

    def _await_sensors(self) -> None:
        """Give every sensor time for its first answer; a silent one is told when it matters."""
        deadline = self.clock.now() + _FIRST_READING
        sensors = [item for winch in self.winch.values() for item in winch.sensors.values()]
        while any(item.latest is None and item.problem is None for item in sensors):
            if self.clock.now() > deadline:
                return
            self.clock.sleep(_POLL)

    def _await_cycles(self, count: int) -> None:
        """Let the loop take notice of what was just ordered."""
        start, deadline = self.loop.count, self.clock.now() + 1.0
        while self.loop.alive and self.loop.count < start + count:
            if self.clock.now() > deadline:
                raise WinchkitError("the control loop hangs; the drives stop by their heartbeat")
            self.clock.sleep(self.spec.cycle / 2)


def open_bench(bench: str | Path | BenchSpec, clock: Clock | None = None) -> Bench:
    """Open a bench by its wiring file: buses, drives commissioned and disabled, sensors polled.

    Use it in a ``with`` block: leaving it, by any exception, stops the winches in a controlled
    way. Raises FileError, ConnectionLost (NoReply, DeviceRefused) and NotPermitted.
    """
    if isinstance(bench, BenchSpec):
        return Bench(bench, clock or MonotonicClock())
    from winchkit.schema.read import read_bench

    return Bench(read_bench(bench), clock or MonotonicClock())
