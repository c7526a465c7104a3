"""What a cycle of eight axes costs, and how steady the cycles are; on the `virtual` interface."""

from __future__ import annotations

import math
import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from statistics import median

from can_cost.drives import Commissionable, Drives
from winchkit import catalog
from winchkit.bench.controller import Controller
from winchkit.bench.loop import ControlLoop, WinchParts
from winchkit.bench.motion import Jog
from winchkit.bench.rope import RopeMap
from winchkit.bench.snapshot import BenchSnapshot
from winchkit.bench.supervisor import Supervisor
from winchkit.drivers.can.axis import Cia402Axis
from winchkit.drivers.can.bus import CanBus
from winchkit.drivers.can.commission import WatchSpec
from winchkit.drivers.reading import Quality, Reading
from winchkit.effects import line_of
from winchkit.errors import ConnectionLost
from winchkit.schema.bench import BusSpec, LimitSpec
from winchkit.schema.read import read_device, read_winch

CYCLE, HEARTBEAT = 0.004, 0.05
LIMITS = LimitSpec(
    speed=0.5, acceleration=1.0, length=(0.5, 9.9), tension_high=800.0, tension_slack=15.0
)
SPEED = 0.01
_WARM_UP = 100


class Clock:
    """The machine's, until it is held."""

    def __init__(self) -> None:
        self.held: float | None = None

    def now(self) -> float:
        """Seconds since an arbitrary start."""
        return time.monotonic() if self.held is None else self.held

    def sleep(self, duration: float) -> None:
        """Return after ``duration`` seconds."""
        if self.held is None:
            time.sleep(max(0.0, duration))


@dataclass
class Cell:
    """A load cell that has just been read."""

    clock: Clock
    problem: ConnectionLost | None = None
    max_age: float = math.inf

    @property
    def latest(self) -> Reading:
        """A reading of 100 N."""
        now = self.clock.now()
        return Reading(100.0, 100.0, 10_000.0, Quality.GOOD, now, now, now, 1e-3)


@dataclass
class Bench:
    """Eight winches, their bus, and the drives on it."""

    clock: Clock
    bus: CanBus
    drives: Drives
    loop: ControlLoop
    jogs: dict[str, Jog]

    @property
    def answered(self) -> bool:
        """Whether every axis has put the whole answer to the newest SYNC together."""
        feedback = [parts.axis.feedback for parts in self.loop.winches.values()]
        return all(item is not None and item.sync == self.loop.count for item in feedback)


@contextmanager
def bench(axes: int) -> Iterator[Bench]:
    """A bench of jogging winches around ``ControlLoop``, not yet running."""
    clock = Clock()
    spec = BusSpec("can", interface="virtual", channel=f"cost-{os.getpid()}", heartbeat=HEARTBEAT)
    nodes = range(1, axes + 1)
    device = read_device(catalog.find("devices", "generic-cia402"))
    profile = read_winch(catalog.find("profiles", "bench-spiral"))
    watch = WatchSpec(127, HEARTBEAT, CYCLE, True, prove=False)
    commissionable = Commissionable(spec, device, nodes)
    bus = CanBus(spec, "can", clock)
    try:
        winches, jogs = {}, {}
        for node in nodes:
            axis = Cia402Axis(bus, node, device, watch, clock)
            axis.commission()
            rope = RopeMap(line_of(profile))
            controller = Controller(axis, rope, LIMITS)
            name = f"W{node}"
            winches[name] = WinchParts(axis, rope, controller, {"cell": Cell(clock)})
            jogs[name] = Jog(rope, LIMITS)
    finally:
        commissionable.close()
    _quiet(bus)
    drives = Drives(spec, nodes, CYCLE)
    supervisor = Supervisor(dict.fromkeys(winches, LIMITS), 2 * HEARTBEAT)
    loop = ControlLoop([(bus, 127, HEARTBEAT)], winches, supervisor, clock, CYCLE)
    try:
        yield Bench(clock, bus, drives, loop, jogs)
    finally:
        loop.close()
        drives.close()
        bus.close()


def begin(it: Bench) -> None:
    """Ask every winch to jog for good."""
    for name, jog in it.jogs.items():
        jog.refresh(SPEED, math.inf)
        it.loop.winches[name].controller.begin(jog)


def cost_of_cycle(axes: int = 8, cycles: int = 2000) -> dict[str, float]:
    """Processor time of a cycle in steady motion, µs: the step, the receive thread, both."""
    with bench(axes) as it:
        it.clock.held = time.monotonic()
        begin(it)
        receiver = time.pthread_getcpuclockid(_receive_thread().ident or 0)
        steps: list[float] = []
        taken: list[float] = []
        for number in range(_WARM_UP + cycles):
            it.clock.held += CYCLE
            took, start = time.clock_gettime(receiver), time.thread_time()
            it.loop.step(it.clock.held)
            step = time.thread_time() - start
            while it.drives.serve(0.0):
                pass
            _await(lambda: it.answered)
            if number >= _WARM_UP:
                steps.append(step)
                taken.append(time.clock_gettime(receiver) - took)
        _check(it)
        step, receive = median(steps) * 1e6, median(taken) * 1e6
        return {"axes": axes, "step_us": step, "receive_us": receive, "cycle_us": step + receive}


def jitter_of_cycle(seconds: float, axes: int = 8) -> dict[str, float]:
    """Deviation of the cycles from their period in real time, ms, and the frames lost."""
    with bench(axes) as it:
        times: list[float] = []
        over = threading.Event()

        def note(snapshot: BenchSnapshot) -> None:
            times.append(snapshot.time)

        def serve() -> None:
            while not over.is_set():
                it.drives.serve(0.02)

        it.loop.samplers.append(note)
        server = threading.Thread(target=serve)
        server.start()
        received, sent = it.bus.received, it.bus.sent
        try:
            it.loop.start()
            time.sleep(0.3)
            # No heartbeat came between the commissioning and the first cycle.
            it.loop.supervisor.reset(
                {name: parts.axis.heartbeat.boot_ups for name, parts in it.loop.winches.items()}
            )
            begin(it)
            time.sleep(seconds)
            moved = it.drives.enabled and not it.loop.supervisor.tripped
        finally:
            it.loop.close()
            time.sleep(0.1)
            over.set()
            server.join()
        lost = it.drives.sent - (it.bus.received - received)
        lost += it.bus.sent - sent - it.drives.received
        return {
            **_spread(times),
            "lost": lost,
            "overruns": it.loop.overruns,
            "kept_moving": moved,
        }


def _spread(times: list[float]) -> dict[str, float]:
    off = sorted(abs(b - a - CYCLE) * 1e3 for a, b in pairwise(times))
    return {
        "cycles": len(times),
        "p50_ms": off[len(off) // 2],
        "p99_ms": off[int(0.99 * (len(off) - 1))],
        "max_ms": off[-1],
    }


def _quiet(bus: CanBus) -> None:
    """Wait until what the commissioned drives said last has been taken in."""
    before = -1
    while bus.received != before:
        before = bus.received
        time.sleep(0.05)


def _receive_thread() -> threading.Thread:
    return next(thread for thread in threading.enumerate() if thread.name == "can-can")


def _await(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 2.0
    while not condition():
        if time.monotonic() > deadline:
            raise RuntimeError("frames were lost on the virtual bus")
        time.sleep(0)


def _check(it: Bench) -> None:
    """Whether what was measured was motion."""
    if not it.drives.enabled or it.loop.supervisor.tripped:
        raise RuntimeError(f"the winches do not move: {it.loop.supervisor.tripped}")
