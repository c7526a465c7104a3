"""A bench that is not there: eight winches at 1 kHz with load cells at 100 Hz.

``python -m recording.synthetic FILE TOLD [--rotate LIMIT]`` records until it is killed. Into
``TOLD`` it writes the number of the newest cycle given to the recorder and its time, and when each
of the last cycles was given, so that whoever kills it knows what there was to lose. Cycle ``n`` has
the motor angle ``n`` at every winch; velocity and torque are noise in every bit, so that no
compression flatters the size.
"""

from __future__ import annotations

import argparse
import math
import mmap
import random
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from winchkit.bench.control.snapshot import BenchSnapshot, Phase, WinchSnapshot
from winchkit.bench.recording.recorder import Recorder
from winchkit.drivers.clock import Clock, MonotonicClock
from winchkit.drivers.counters import Counters
from winchkit.drivers.reading import InstrumentReading, Quality
from winchkit.errors import ConnectionLost
from winchkit.runs.recording.rotation import Rotation

TOLD = struct.Struct("<qd")
GIVEN = struct.Struct("<d")
REMEMBERED = 8192
WINCHES, CYCLE, EVERY = 8, 1e-3, 10


@dataclass
class Cell:
    """A load cell that says what it is set to."""

    name: str
    period: float = CYCLE * EVERY
    max_age: float = 1.0
    latest: InstrumentReading | None = None
    problem: ConnectionLost | None = None
    counters: Counters = field(default_factory=Counters)
    tared: bool | None = None
    host_tare: float = 0.0
    listeners: list[Callable[[InstrumentReading], None]] = field(default_factory=list)

    def read(self, value: float, now: float) -> None:
        """Give a reading to everybody who listens."""
        reading = InstrumentReading(
            value=value,
            gross=value,
            raw=round(value * 100),
            quality=Quality.GOOD,
            t_request=now - 2e-3,
            t_receive=now,
            t_sample=now - 6e-3,
            t_uncertainty=1e-3,
        )
        for listener in tuple(self.listeners):
            listener(reading)


class SyntheticBench:
    """Gives snapshots and readings at their times on a clock."""

    def __init__(self, clock: Clock, winches: int = WINCHES, cycle: float = CYCLE) -> None:
        self.cells = {f"W{n}": Cell(f"W{n}") for n in range(1, winches + 1)}
        self.sensors = {name: {"cell": cell} for name, cell in self.cells.items()}
        self.count = 0
        self._noise = random.Random(1)
        self._clock, self._cycle = clock, cycle
        self._due = clock.now()

    def step(self, feed: Callable[[BenchSnapshot], None]) -> float:
        """Wait for the next cycle and give it; returns its time."""
        self._clock.sleep(max(0.0, self._due - self._clock.now()))
        now, self._due = self._due, self._due + self._cycle
        feed(self.picture(now))
        if self.count % EVERY == 0:
            for n, cell in enumerate(self.cells.values()):
                cell.read(200 + 20 * math.sin(now + n) + 0.1 * math.sin(7919 * now), now)
        self.count += 1
        return now

    def picture(self, now: float) -> BenchSnapshot:
        """The snapshot of a cycle."""
        noise = self._noise.random
        winches = {
            name: WinchSnapshot(
                phase=Phase.MOVING,
                state="operation enabled",
                time=now,
                motor_angle=float(self.count),
                motor_velocity=noise(),
                motor_torque=noise(),
                cable_length=3.0,
                cable_speed=-0.06,
            )
            for name in self.cells
        }
        return BenchSnapshot(now, self.count, winches)


def record(path: Path, told: Path, rotate: str | None) -> None:
    """Record until killed."""
    clock = MonotonicClock()
    with told.open("r+b") as stream, mmap.mmap(stream.fileno(), 0) as shared:
        bench = SyntheticBench(clock)
        rotation = None if rotate is None else Rotation.parse(rotate)
        recorder = Recorder(path, bench.sensors, clock, {"bench": "synthetic"}, rotation=rotation)
        while True:
            now = bench.step(recorder.feed)
            place = TOLD.size + (bench.count - 1) % REMEMBERED * GIVEN.size
            GIVEN.pack_into(shared, place, clock.now())
            TOLD.pack_into(shared, 0, bench.count, now)
            recorder.check()


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("path", type=Path)
    parser.add_argument("told", type=Path)
    parser.add_argument("--rotate")
    given = parser.parse_args()
    record(given.path, given.told, given.rotate)
