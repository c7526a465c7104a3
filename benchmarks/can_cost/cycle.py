"""What a cycle of many axes costs, and how late the cycles are, in held and in real time."""

from __future__ import annotations

import gc
import math
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from statistics import median
from typing import Any, Literal, Protocol
from unittest.mock import patch

from can_cost.drives import Commissionable, Drives
from can_cost.far_drives import FarDrives
from can_cost.probe import Probes
from can_cost.wire import PairLibrary, VirtualWire
from winchkit import catalog
from winchkit.bench.control.cable import CableMap
from winchkit.bench.control.controller import Controller
from winchkit.bench.control.dead_man import DeadMan
from winchkit.bench.control.loop import ControlLoop, WinchParts
from winchkit.bench.control.motion import Jog
from winchkit.bench.control.observation import Supervised
from winchkit.bench.control.realtime import RealTime, RestCollector, acquire
from winchkit.bench.control.supervisor import Supervisor
from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.bus.socketcan import SocketCan
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.cia402.commission import WatchSpec
from winchkit.drivers.reading import InstrumentReading, Quality
from winchkit.effects import line_of
from winchkit.errors import ConnectionLost
from winchkit.schema.bench import BusSpec, LimitSpec
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.read import read_device, read_profile

CYCLE, HEARTBEAT = 0.004, 0.05
LIMITS = LimitSpec(
    speed=0.5, acceleration=1.0, length=(0.5, 9.9), tension_high=800.0, tension_slack=15.0
)
SPEED = 0.01
_CELL_PERIOD = 0.01
_WARM_UP = 100
Link = Literal["virtual", "socket"]


class Clock:
    """The machine's, until it is held; notes how late each sleep of the control thread ends."""

    def __init__(self) -> None:
        self.held: float | None = None
        self.late: list[tuple[float, float]] = []
        """When a cycle was due, and when it began, s."""

    def now(self) -> float:
        """Seconds since an arbitrary start."""
        return time.monotonic() if self.held is None else self.held

    def sleep(self, duration: float) -> None:
        """Return after ``duration`` seconds."""
        if self.held is not None:
            return
        if threading.current_thread().name != "control":
            time.sleep(max(0.0, duration))
            return
        due = time.monotonic() + duration
        if duration > 0:
            time.sleep(duration)
        self.late.append((due, time.monotonic()))


@dataclass
class Cell:
    """A load cell that is read at 100 Hz."""

    clock: Clock
    problem: ConnectionLost | None = None
    max_age: float = math.inf
    _newest: InstrumentReading | None = None

    @property
    def latest(self) -> InstrumentReading:
        """A reading of 100 N."""
        now, newest = self.clock.now(), self._newest
        if newest is None or now - newest.t_receive >= _CELL_PERIOD:
            newest = InstrumentReading(100.0, 100.0, 10_000.0, Quality.GOOD, now, now, now, 1e-3)
            self._newest = newest
        return newest


class DriveBus(Protocol):
    """The drives of one bus, wherever they are."""

    def open(self, spec: BusSpec, clock: Clock) -> CanBus:
        """The bench's bus to them."""

    def run(self) -> None:
        """After commissioning: answer frames alone."""

    def serve(self, timeout: float) -> bool:
        """Take one frame; False where there was none, or where they serve themselves."""

    def report(self) -> tuple[int, int, bool]:
        """Frames received and sent, and whether every drive is enabled."""

    def close(self) -> None:
        """End them."""


class NearDrives:
    """Drives in this process, on python-can's `virtual` interface."""

    def __init__(self, channel: str, nodes: range, cycle: float, device: DeviceSpec) -> None:
        self._wire, self._nodes, self._cycle = VirtualWire(channel), nodes, cycle
        self._commissionable = Commissionable(self._wire, device, nodes)
        self._drives: Drives | None = None

    def open(self, spec: BusSpec, clock: Clock) -> CanBus:
        """The bench's bus to them."""
        return CanBus(spec, spec.channel or "can", clock)

    def run(self) -> None:
        """After commissioning: answer frames alone."""
        self._commissionable.close()
        self._drives = Drives(self._wire, self._nodes, self._cycle)

    def serve(self, timeout: float) -> bool:
        """Take one frame; whether there was one."""
        return self._drives is not None and self._drives.serve(timeout)

    def report(self) -> tuple[int, int, bool]:
        """Frames received and sent, and whether every drive is enabled."""
        assert self._drives is not None
        return self._drives.received, self._drives.sent, self._drives.enabled

    def close(self) -> None:
        """End them."""
        self._commissionable.close()
        self._wire.close()


class OtherProcess(FarDrives):
    """Drives in a process of their own, reached by winchkit's SocketCAN code."""

    def open(self, spec: BusSpec, clock: Clock) -> CanBus:
        """The bench's bus to them."""
        library = PairLibrary(self.end)
        with patch("winchkit.drivers.can.bus.bus.open_interface", lambda *_: SocketCan(library)):
            return CanBus(spec, spec.channel or "can", clock)

    def run(self) -> None:
        """After commissioning: answer frames alone."""
        self.commissioned()

    def serve(self, timeout: float) -> bool:
        """They serve themselves."""
        time.sleep(timeout)
        return False


@dataclass
class Bench:
    """Winches, their buses, and the drives on them."""

    clock: Clock
    buses: Sequence[CanBus]
    drives: Sequence[DriveBus]
    loop: ControlLoop
    jogs: dict[str, Jog] = field(default_factory=dict)

    @property
    def answered(self) -> bool:
        """Whether every axis has put the whole answer to the newest SYNC together."""
        feedback = [parts.axis.feedback for parts in self.loop.winches.values()]
        return all(item is not None and item.sync == self.loop.count for item in feedback)

    @property
    def enabled(self) -> bool:
        """Whether all drives are."""
        return all(drives.report()[2] for drives in self.drives)

    def counts(self) -> tuple[int, int, int, int]:
        """Frames: received and sent by the bench, received and sent by the drives."""
        reports = [drives.report() for drives in self.drives]
        return (
            sum(bus.received for bus in self.buses),
            sum(bus.sent for bus in self.buses),
            sum(report[0] for report in reports),
            sum(report[1] for report in reports),
        )


@contextmanager
def bench(
    axes: int,
    link: Link = "virtual",
    buses: int = 1,
    cycle: float = CYCLE,
    heartbeat: float = HEARTBEAT,
) -> Iterator[Bench]:
    """A bench of jogging winches around ``ControlLoop``, not yet running."""
    clock = Clock()
    device = read_device(catalog.find("devices", "generic-cia402"))
    profile = read_profile(catalog.find("profiles", "bench-spiral"))
    watch = WatchSpec(
        127, heartbeat, cycle, True, prove=False, speed=30.0, response=0.06, late=0.06
    )
    winches, opened, served = {}, [], []
    with ExitStack() as stack:
        for number in range(buses):
            nodes = range(1, axes // buses + 1)
            channel = f"cost{number}-{os.getpid()}"
            spec = BusSpec("can", interface="virtual", channel=channel, heartbeat=heartbeat)
            drives: DriveBus = (
                NearDrives(channel, nodes, cycle, device)
                if link == "virtual"
                else OtherProcess(nodes, cycle)
            )
            stack.callback(drives.close)
            bus = drives.open(spec, clock)
            stack.callback(bus.close)
            for node in nodes:
                axis = Cia402Axis(bus, node, device, watch, clock)
                axis.commission()
                cable = CableMap(line_of(profile))
                parts = WinchParts(
                    axis, cable, Controller(axis, cable, LIMITS), {"cell": Cell(clock)}
                )
                winches[f"W{number}{node}"] = parts
            drives.run()
            _quiet(bus)
            opened.append(bus)
            served.append(drives)
        supervisor = Supervisor(dict.fromkeys(winches, Supervised(LIMITS, 2 * heartbeat, cycle)))
        hosts = [(bus, 127, heartbeat) for bus in opened]
        loop = ControlLoop(hosts, winches, supervisor, clock, cycle, longest_gap=2 * heartbeat)
        stack.callback(loop.close)
        for parts in winches.values():
            # No heartbeat comes between the commissioning and the first cycle.
            parts.axis.heartbeat.last = None
        jogs = {
            name: Jog(parts.cable, LIMITS, SPEED, DeadMan(math.inf))
            for name, parts in winches.items()
        }
        yield Bench(clock, opened, served, loop, jogs)


def begin(it: Bench) -> None:
    """Ask every winch to jog for good."""
    for name, jog in it.jogs.items():
        it.loop.winches[name].controller.begin(jog)


def cost_of_cycle(axes: int = 8, cycles: int = 2000, link: Link = "virtual") -> dict[str, float]:
    """Processor time of a cycle in steady motion, µs: the step, the receive thread, both."""
    with bench(axes, link) as it:
        it.clock.held = time.monotonic()
        begin(it)
        receivers = [time.pthread_getcpuclockid(_thread(f"can-{b.name}")) for b in it.buses]
        steps: list[float] = []
        taken: list[float] = []
        for number in range(_WARM_UP + cycles):
            it.clock.held += CYCLE
            took, start = _spent(receivers), time.thread_time()
            it.loop.step(it.clock.held)
            step = time.thread_time() - start
            while any(drives.serve(0.0) for drives in it.drives):
                pass
            _await(lambda: it.answered)
            if number >= _WARM_UP:
                steps.append(step)
                taken.append(_spent(receivers) - took)
        _check(it)
        step, receive = median(steps) * 1e6, median(taken) * 1e6
        least = sorted(map(sum, zip(steps, taken, strict=True)))[len(steps) // 10] * 1e6
        return {
            "axes": axes,
            "step_us": step,
            "receive_us": receive,
            "cycle_us": step + receive,
            "cycle_p10_us": least,
        }


def lateness_of_cycle(
    seconds: float,
    axes: int = 8,
    *,
    link: Link = "virtual",
    buses: int = 1,
    cycle: float = CYCLE,
    heartbeat: float = HEARTBEAT,
    busy: int = 0,
    realtime: bool = False,
) -> dict[str, Any]:
    """How late the cycles begin in real time, ms, what they cost, and the frames lost."""
    with bench(axes, link, buses, cycle, heartbeat) as it, ExitStack() as stack:
        over = threading.Event()
        for drives in it.drives:
            server = threading.Thread(target=_serve, args=(drives, over))
            server.start()
            stack.callback(server.join)
        stack.callback(over.set)
        before = it.counts()
        pauses = _Pauses(stack)
        for _ in range(busy):
            _occupy(stack)
        probes = Probes() if realtime else None
        if realtime:
            it.loop.samplers.append(RestCollector())
        it.loop.start()
        stack.callback(it.loop.close)
        time.sleep(0.1)
        settings = acquire("try" if realtime else False, [it.loop.thread_id, *_receive_ids(it)])
        stack.callback(settings.close)
        time.sleep(0.2)
        # No heartbeat came between the commissioning and the first cycle.
        boot_ups = {name: one.axis.heartbeat.boot_ups for name, one in it.loop.winches.items()}
        it.loop.supervisor.acknowledge(boot_ups)
        it.loop.clear_latch()
        begin(it)
        time.sleep(0.5)
        it.clock.late.clear()
        pauses.clear()
        began, spent = time.monotonic(), time.process_time()
        it.loop.overruns = 0
        time.sleep(seconds)
        share = (time.process_time() - spent) / (time.monotonic() - began)
        late = list(it.clock.late)
        stalls = [] if probes is None else probes.close()
        moved = it.enabled and not it.loop.supervisor.tripped
        it.loop.close()
        time.sleep(0.2)
        return {
            "busy": busy,
            "cycles": len(late),
            **_quantiles(sorted(woke - due for due, woke in late)),
            **_own(late, stalls),
            "overruns": it.loop.overruns,
            "lost": _lost(before, it.counts()),
            "collector_max_ms": max(pauses, default=0.0) * 1e3,
            "core_share": share,
            "kept_moving": moved,
            "trips": [str(trip) for trip in it.loop.supervisor.tripped],
            "settings": _words(settings),
        }


class _Pauses(list[float]):
    """Durations of the collector's runs, s."""

    def __init__(self, stack: ExitStack) -> None:
        super().__init__()
        self._began = 0.0
        gc.callbacks.append(self._note)
        stack.callback(gc.callbacks.remove, self._note)

    def _note(self, phase: str, _info: dict[str, int]) -> None:
        now = time.perf_counter()
        if phase == "start":
            self._began = now
        else:
            self.append(now - self._began)


def _words(settings: RealTime) -> list[str]:
    return [f"{'+' if item.granted else '-'} {item}" for item in settings.items]


def _occupy(stack: ExitStack) -> None:
    """A process that computes without end."""
    busy = subprocess.Popen([sys.executable, "-c", "while True: pass"])
    stack.callback(busy.wait)
    stack.callback(busy.kill)


def _serve(drives: DriveBus, over: threading.Event) -> None:
    while not over.is_set():
        drives.serve(0.02)


def _quantiles(late: Sequence[float]) -> dict[str, float]:
    """Of sorted values in s, in ms."""
    if not late:
        return {}
    found = {
        f"p{share * 100:g}_ms": late[int(share * (len(late) - 1))] * 1e3
        for share in (0.5, 0.9, 0.99, 0.999)
    }
    return {**found, "max_ms": late[-1] * 1e3}


def _own(
    late: Sequence[tuple[float, float]], stalls: Sequence[tuple[float, float]]
) -> dict[str, float]:
    """The same without cycles during which the computer itself stood still, as probes saw it."""
    if not stalls:
        return {}
    own = sorted(
        woke - due
        for due, woke in late
        if not any(begin < woke and due < end for begin, end in stalls)
    )
    return {
        "computer_max_ms": max(end - begin for begin, end in stalls) * 1e3,
        "computer_stalls": len(stalls),
        **{f"own_{name}": value for name, value in _quantiles(own).items()},
        "own_cycles": len(own),
    }


def _lost(before: tuple[int, int, int, int], after: tuple[int, int, int, int]) -> int:
    """Frames that were sent and not received, both ways."""
    heard, said, there, answered = (b - a for a, b in zip(before, after, strict=True))
    return answered - heard + said - there


def _quiet(bus: CanBus) -> None:
    """Wait until what the commissioned drives said last has been taken in."""
    before = -1
    while bus.received != before:
        before = bus.received
        time.sleep(0.05)


def _receive_ids(it: Bench) -> list[int]:
    return [bus.thread_id for bus in it.buses]


def _thread(name: str) -> int:
    return next(one for one in threading.enumerate() if one.name == name).ident or 0


def _spent(clocks: Sequence[int]) -> float:
    """Processor time of these threads, s."""
    return sum(map(time.clock_gettime, clocks))


def _await(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 2.0
    while not condition():
        if time.monotonic() > deadline:
            raise RuntimeError("frames were lost on the bus")
        time.sleep(0)


def _check(it: Bench) -> None:
    """Whether what was measured was motion."""
    if not it.enabled or it.loop.supervisor.tripped:
        raise RuntimeError(f"the winches do not move: {it.loop.supervisor.tripped}")
