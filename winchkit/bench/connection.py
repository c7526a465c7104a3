"""Connection of an open bench: buses, drives, instruments, control loop, and logs of them."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from winchkit.bench.control.loop import Callback, ControlLoop
from winchkit.bench.control.realtime import RealTime, Request, RestCollector, acquire
from winchkit.bench.control.snapshot import BenchSnapshot
from winchkit.bench.drives.set_up_progress import Tell, to_stderr
from winchkit.bench.hardware import Wired, wire
from winchkit.bench.lifecycle import await_feedback, await_sensors
from winchkit.bench.ownership import Ownership
from winchkit.bench.recording.provenance import origin
from winchkit.bench.recording.recorder import Recorder
from winchkit.bench.recording.trip_history import TripHistory
from winchkit.bench.records.latch import LatchFile
from winchkit.bench.records.position_file import PositionFile
from winchkit.drivers.can.bus.frame_tap import FrameTap
from winchkit.drivers.can.bus.health import BusHealth
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.tools.scan import ScannedNode, named_after, scan
from winchkit.drivers.clock import Clock
from winchkit.drivers.scheduling import Scheduler
from winchkit.runs.recording.rotation import Rotation
from winchkit.schema.bench import BenchSpec

if TYPE_CHECKING:
    from winchkit.bench.tracker import TrackerReceiver

_WATCHED = 2.0
"""Frames are collected for so long after somebody asked for them, s."""


class BenchConnection(ABC):
    """The hardware of a bench with its control loop, from opening to closing.

    A subclass commands it: it calls :meth:`_start` when it is ready for cycles, and
    :meth:`_close_logs` at the end of :meth:`close`. ``_stack`` closes what was opened, in reverse
    order. ``separate``: a process of its own reads the instruments that are not on CAN.
    """

    def __init__(
        self,
        spec: BenchSpec,
        clock: Clock,
        ownership: Ownership,
        *,
        separate: bool = False,
        tell: Tell = to_stderr,
    ) -> None:
        """Open buses and devices; nothing is left open by an error. No cycle runs yet."""
        self.spec = spec
        self.clock = clock
        self._recorders: list[Recorder] = []
        self._tracker: TrackerReceiver | None = None
        self._tracker_lock = threading.Lock()
        with ExitStack() as stack:
            stack.callback(ownership.close)
            latch, positions = LatchFile(spec.latch_file), PositionFile(spec.position_file)
            stack.callback(latch.close)
            stack.callback(positions.close)
            trips, ended_in_motion = latch.open(), positions.open()
            self._wired: Wired = wire(
                spec, clock, stack, latch, positions, separate=separate, tell=tell
            )
            self.loop: ControlLoop = self._wired.loop
            self.loop.restore(trips, ended_in_motion)
            self.axes: Mapping[str, Cia402Axis] = self._wired.axes
            self.trip_history = TripHistory(self.loop.cycle)
            """The cycles around the newest trip."""
            self.loop.samplers.append(self.trip_history)
            self._stack = stack.pop_all()

    def _start(self, realtime: Request) -> None:
        """Start the control loop; return when every drive and instrument has answered."""
        self.realtime: RealTime = acquire(
            realtime, self._urgent_threads(), simulated=isinstance(self.clock, Scheduler)
        )
        """What the control loop was granted of real-time settings, and what was refused."""
        self._stack.callback(self.realtime.close)
        if realtime:
            self.loop.samplers.append(RestCollector())
        self._stack.callback(self.loop.close)
        self.loop.start()
        await_feedback(self.loop, self.axes, self.clock)
        self.realtime.cover(self._urgent_threads(), self._wired.companions)
        if self._wired.companions:
            self.realtime = self.realtime.with_instruments()
        sensors = self._wired.sensors
        await_sensors((s for one in self.loop.winches for s in sensors[one].values()), self.clock)

    @abstractmethod
    def close(self) -> None:
        """Stop every winch in a controlled way and let the buses go. Twice does no harm."""

    def _close_logs(self) -> None:
        for recorder in tuple(self._recorders):
            recorder.close()
        if self._tracker is not None:
            self._tracker.close()

    @property
    def tracker(self) -> TrackerReceiver | None:
        """The tracker of its robot, received from the first use on; None where none is declared.

        Raises ConnectionLost where its address is in use.
        """
        wiring = None if self.spec.robot is None else self.spec.robot.tracker
        if wiring is None:
            return None
        from winchkit.bench.tracker import TrackerReceiver

        with self._tracker_lock:
            if self._tracker is None:
                self._tracker = TrackerReceiver(self.clock.now)
                if isinstance(self.clock, Scheduler):
                    self.clock.receive_datagrams(wiring.listen, self._tracker.receive)
                else:
                    self._tracker.listen(wiring.listen)
            return self._tracker

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

    @property
    def bus_health(self) -> dict[str, BusHealth]:
        """What happened on each CAN bus since it was opened, by name."""
        return {name: bus.health for name, bus in self._wired.buses.items()}

    def frames(self) -> dict[str, FrameTap]:
        """Frames of each CAN bus by name, collected from the first call on while it is called.

        Returns
        -------
        dict of str to FrameTap
            The newest frame of each identifier, and the last ones.
        """
        expires = self.clock.now() + _WATCHED
        found = {}
        for name, bus in self._wired.buses.items():
            tap = bus.tap or FrameTap(expires)
            tap.expires = expires
            bus.tap = found[name] = tap
        return found

    def on_cycle(self, callback: Callback) -> Callable[[], None]:
        """Call a function with every cycle's snapshot, on the control thread.

        It may return a ``winding_speed`` (m/s, positive winds in) by winch, which moves it for
        as long as it keeps returning one; after a stop or a reset it has to return none for 0.2 s
        first. The loop waits for it: it may read everything, and call ``stop_now``, which acts and
        returns at once there, and what takes ``wait=False`` (``stop``, ``move_to``, ``move_by``).
        What waits raises UsageError there: ``reset``, ``close``, ``home``, ``tare``, ``wait``, a
        ``duration``, and moves and stops that wait. Should it raise, everything stops and the
        exception comes out of the ``with`` block. Returns a function that takes it off again.

        Parameters
        ----------
        callback : callable
            Takes a BenchSnapshot; returns None or winding speeds by winch.

        Returns
        -------
        callable
            Removes the callback.
        """
        self.loop.callbacks.append(callback)

        def remove() -> None:
            with suppress(ValueError):
                self.loop.callbacks.remove(callback)

        return remove

    def scan(self) -> list[ScannedNode]:
        """Who is on the CAN buses; reads only. Raises ConnectionLost."""
        wiring = {name: one.servo for name, one in self.spec.winch.items()}
        found = []
        for name, bus in self._wired.buses.items():
            own = {ref.node or 1: self.axes[w] for w, ref in wiring.items() if ref.bus == name}
            found += scan(bus, self.spec.bus[name], self.clock, own)
        return named_after(self.spec, found)

    def log(
        self,
        path: str | Path,
        metadata: Mapping[str, str] | None = None,
        rotate: str | None = None,
        *,
        replace: bool = False,
    ) -> Recorder:
        """Start logging to a file; ``with bench.log("lift.csv"):`` ends it.

        With ``rotate`` (``"100MB"`` or ``"10min"``) it goes on in ``lift.002.csv`` and so on. An
        earlier log of that name is removed with ``replace`` only. Raises UsageError for one that is
        there without ``replace``, or that is being written; FileError; ConnectionLost where the
        robot's tracker cannot be received.

        Parameters
        ----------
        path : str or Path
            File, ``.csv`` or ``.mcap``.
        metadata : mapping, optional
            Further metadata, keys and texts.
        rotate : str, optional
            Size or duration of a part.
        replace : bool
            Remove an earlier log of that name.

        Returns
        -------
        Recorder
            The log; its ``close``, or the end of its ``with`` block, ends it.
        """
        recorder = Recorder(
            path,
            {name: self._wired.sensors[name] for name in self.loop.winches},
            self.clock,
            {**self._wired.metadata, **origin(self.spec), **(metadata or {})},
            self._stop_feeding,
            tracker=self.tracker,
            rotation=None if rotate is None else Rotation.parse(rotate),
            replace=replace,
        )
        self._recorders.append(recorder)
        self.loop.samplers.append(recorder.feed)
        return recorder

    def _urgent_threads(self) -> list[int]:
        """Native ids of the control thread and the receive threads, as far as they run."""
        ids = [self.loop.thread_id, *(bus.thread_id for bus in self._wired.buses.values())]
        return [number for number in ids if number]

    def _stop_feeding(self, recorder: Recorder) -> None:
        if recorder in self._recorders:
            self._recorders.remove(recorder)
            with suppress(ValueError):  # the loop has dropped one that failed
                self.loop.samplers.remove(recorder.feed)
