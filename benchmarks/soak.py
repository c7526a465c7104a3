"""Eight winches at 250 Hz for a long time: memory, lost samples, unreported missed cycles.

``python benchmarks/soak.py --minutes 30 --json``. The drives (the slaves of
``tests/support/slave``, over a pair of datagram sockets) and the load cells (Modbus TCP) run in a
process of their own, the bench with its recorder in this one. Prints one JSON object; exit 1 where
memory grows by more than 1 MB/h, a sample is lost or a missed cycle is not reported. See
benchmarks/README.md.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import math
import multiprocessing
import os
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from soak_devices import Wire, serve
from winchkit.bench.bench import Bench
from winchkit.bench.control.snapshot import BenchSnapshot
from winchkit.bench.open import open_bench
from winchkit.drivers.clock import MonotonicClock

WINCHES = "ABCDEFGH"
CYCLE = 0.004
_SAMPLED = 5.0
_WARM_UP = 0.2
"""Share of the time, at least 30 s."""
_MISSED = 2.05
"""A longer gap, in cycles, holds a whole period without a cycle, which the loop has to report in
the cycle that ends the gap."""
_ROTATE = "60 s"
"""A part has an index in memory, 0.3 kB a chunk, until it is closed: parts shorter than the samples
of the memory keep it out of the growth."""
_PERIOD, _SPEED = 20.0, 0.1
_LOSSES = ("samples_lost", "cell_drops", "feedback_missed", "missed_unreported", "trips")


class Watch:
    """Counts gaps between cycles by itself, and moves every winch up and down."""

    def __init__(self) -> None:
        self.cycles = self.gaps = self.unreported = 0
        self.longest = 0.0
        self._before = math.nan
        self._overruns = 0
        self._began = math.nan

    def __call__(self, snapshot: BenchSnapshot) -> dict[str, float]:
        """Note the cycle; winding speeds by winch."""
        gap = snapshot.time - self._before
        self._before = snapshot.time
        self.cycles += 1
        if math.isfinite(gap):
            missed = gap > _MISSED * CYCLE
            self.gaps += missed
            self.unreported += missed and snapshot.overruns == self._overruns
            self.longest = max(self.longest, gap)
        else:
            self._began = snapshot.time
        self._overruns = snapshot.overruns
        phase = 2 * math.pi * (snapshot.time - self._began) / _PERIOD
        return dict.fromkeys(snapshot.winch, _SPEED * math.sin(phase))


class DeviceClock(MonotonicClock):
    """The machine's clock, with the wire to the drives for a CAN bus."""

    def __init__(self, own: str, other: str) -> None:
        self._ends = own, other

    def thread(self, target: Callable[[], None], name: str) -> threading.Thread:
        """A thread, not started yet."""
        return threading.Thread(target=target, name=name, daemon=True)

    def event(self) -> threading.Event:
        """An event."""
        return threading.Event()

    def lock(self) -> AbstractContextManager[Any]:
        """A lock."""
        return threading.Lock()

    def event_loop(self) -> asyncio.AbstractEventLoop:
        """An event loop."""
        return asyncio.new_event_loop()

    def can_port(self, _channel: str) -> Wire:
        """The host's end of the wire."""
        return Wire(*self._ends)

    def serial_port(self, _port: str) -> None:
        """There is none."""


def resident() -> float:
    """Resident memory of this process, MB."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def bench_file(folder: Path, cells: int | None) -> Path:
    """A bench of eight winches, each with a load cell at the port ``cells``, or without any."""
    lines = [
        "schema = 1",
        'kind = "bench"',
        'name = "soak"',
        f'cycle = "{CYCLE * 1e3:g} ms"',
        "[bus.can]",
        'kind = "can"',
        'interface = "virtual"',
        f'channel = "soak-{os.getpid()}"',
        'heartbeat = "200 ms"',
    ]
    if cells is not None:
        lines += [
            "[bus.cells]",
            'kind = "modbus-tcp"',
            'host = "127.0.0.1"',
            f"port = {cells}",
        ]
    for number, name in enumerate(WINCHES, start=1):
        lines += [
            f"[winch.{name}]",
            'profile = "bench-spiral"',
            f'servo = {{ device = "generic-cia402", bus = "can", node = {number}, '
            'encoder = "absolute" }',
            f'cell = {{ device = "laumas-tlb", bus = "cells", unit = {number}, rate = "25 Hz" }}'
            if cells is not None
            else "",
            "brake = true",
            f"[winch.{name}.limits]",
            'speed = "0.3 m/s"',
            'acceleration = "1 m/s^2"',
        ]
    path = folder / "soak.toml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def measured(bench: Bench, folder: Path, duration: float) -> dict[str, Any]:
    """Let it run; what was counted."""
    watch = Watch()
    recorder = bench.log(folder / "soak.mcap", rotate=_ROTATE)
    remove = bench.on_cycle(watch)
    before = {name: axis.health for name, axis in bench.axes.items()}
    overruns, begun = bench.loop.overruns, time.monotonic()
    times, memory = [], []
    trips = ""
    while (passed := time.monotonic() - begun) < duration:
        time.sleep(min(_SAMPLED, duration - passed))
        if passed > max(_WARM_UP * duration, min(30.0, duration / 3)):
            times.append(time.monotonic() - begun)
            memory.append(resident())
        for part in sorted(folder.glob("soak.*.mcap"))[:-2]:
            part.unlink()
        trips = trips or "; ".join(map(str, bench.snapshot.tripped))
    remove()
    health = {name: axis.health for name, axis in bench.axes.items()}
    drops = recorder.counters()
    recorder.close()
    slope = float(np.polyfit(times, memory, 1)[0]) * 3600 if len(times) > 2 else math.nan
    return {
        "minutes": round(duration / 60, 2),
        "cycles": watch.cycles,
        "missed_cycles": watch.gaps,
        "missed_unreported": watch.unreported,
        "overruns": bench.loop.overruns - overruns,
        "longest_gap_s": round(watch.longest, 4),
        "memory_mb": round(memory[-1], 1) if memory else None,
        "growth_mb_h": round(slope, 2),
        "samples_lost": int(drops["log"]["drops"]),
        "feedback_missed": sum(health[n].missed - before[n].missed for n in health),
        "cell_readings": sum(drops[f"{n}.cell"]["readings"] for n in WINCHES),
        "cell_drops": sum(drops[f"{n}.cell"]["drops"] for n in WINCHES),
        "trips": trips,
        "realtime": [item.name for item in bench.realtime.items if item.granted],
    }


def run(duration: float, *, realtime: bool = False) -> dict[str, Any]:
    """Devices in one process, the bench in this one."""
    ours, theirs = multiprocessing.Pipe()
    context = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        drives, host = str(folder / "drives"), str(folder / "host")
        arguments = (theirs, len(WINCHES), drives, host, realtime)
        devices = context.Process(target=serve, args=arguments, daemon=True)
        devices.start()
        try:
            cells = received(ours)
            file, clock = bench_file(folder, cells), DeviceClock(host, drives)
            with open_bench(file, clock, realtime="try" if realtime else False) as bench:
                return measured(bench, folder, duration)
        finally:
            ours.send("end")
            devices.join(10.0)


def received(connection: Connection) -> int:
    """Port of the cells, once the devices are ready."""
    if not connection.poll(30.0):
        raise SystemExit("the devices did not start")
    return int(connection.recv())


def main() -> int:
    """Exit 1 where something was lost, not reported, or memory grows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--realtime", action="store_true", help="priority, locked memory")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    found = {"schema": 1, **run(60 * arguments.minutes, realtime=arguments.realtime)}
    print(json.dumps(found) if arguments.json else found)
    lost = any(found[key] for key in _LOSSES)
    return 1 if lost or not found["growth_mb_h"] <= 1.0 else 0


if __name__ == "__main__":
    raise SystemExit(main())
