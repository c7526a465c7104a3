"""A recorder fed by hand: two winches, their cells and a thermometer, on a clock that is set."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from winchkit.bench.control.snapshot import BenchSnapshot, Phase, Trip, WinchSnapshot
from winchkit.bench.recording.recorder import Recorder
from winchkit.drivers.reading import InstrumentReading, Quality
from winchkit.errors import FileError
from winchkit.runs.recording.rotation import Rotation

BENCHMARKS = str(Path(__file__).parents[2] / "benchmarks")
SUPPORT = str(Path(__file__).parent)
if BENCHMARKS not in sys.path:
    sys.path.insert(0, BENCHMARKS)

from recording.synthetic import Cell  # noqa: E402

CYCLE, DELAY = 4e-3, 11e-3
EVERY = {"cell": 5, "temperature": 25}


class SetClock:
    """Time as the test says."""

    def __init__(self, now: float = 500.0) -> None:
        self.time = now

    def now(self) -> float:
        return self.time

    def sleep(self, duration: float) -> None:
        self.time += max(duration, 0.0)


class Fed:
    """Gives cycles and readings of signals that are known at every moment."""

    def __init__(self, clock: SetClock, winches: str = "AB") -> None:
        self.clock = clock
        self.sensors = {
            name: {"cell": Cell(f"{name}.cell"), "temperature": Cell(f"{name}.temperature", 0.1)}
            for name in winches
        }
        self.phase, self.tripped, self.cycle = Phase.MOVING, (), 0
        self.commander = ""
        self.silent: set[str] = set()
        """Sources of which nothing comes: ``A.cell``, ``A.drive``."""
        self._frozen: dict[str, float] = {}
        """Times of the last samples of silent drives, s."""

    def run(self, recorder: Recorder, duration: float) -> None:
        """So many seconds, at once."""
        for _ in range(round(duration / CYCLE)):
            self.clock.time += CYCLE
            self.cycle += 1
            with suppress(FileError):  # the control loop goes on, with a warning
                recorder.feed(self.snapshot())
            for by_role in self.sensors.values():
                for role, cell in by_role.items():
                    if self.cycle % EVERY[role] == 0 and cell.name not in self.silent:
                        value = tension(self.clock.time - DELAY) if role == "cell" else 20.0
                        give(cell, value, self.clock.time)

    def run_until_written(self, recorder: Recorder, duration: float) -> None:
        """So many seconds, and wait until the recorder has written four fifths of their rows."""
        written = recorder.rows
        self.run(recorder, duration)
        while recorder.rows < written + 0.8 * duration / (EVERY["cell"] * CYCLE):
            recorder.check()
            os.sched_yield()

    def snapshot(self) -> BenchSnapshot:
        now = self.clock.time - CYCLE
        winch = WinchSnapshot(
            phase=self.phase,
            state="operation enabled",
            time=now,
            motor_angle=angle(now),
            motor_velocity=1.0,
            motor_torque=2.0,
            cable_length=3.0,
            cable_speed=-0.1,
            commander=self.commander,
        )
        winches = dict.fromkeys(self.sensors, winch)
        for name in self.sensors:
            if f"{name}.drive" in self.silent:
                last = self._frozen.setdefault(name, now)
                winches[name] = winch._replace(time=last)
        return BenchSnapshot(self.clock.time, self.cycle, winches, self.tripped)

    def trip(self, message: str) -> None:
        self.tripped = (Trip("tension", "A", message, latches=True),)


def give(cell: Cell, value: float, now: float, quality: Quality = Quality.GOOD) -> None:
    reading = InstrumentReading(
        value=value,
        gross=value + 1,
        raw=value if math.isnan(value) else round(value * 10),
        quality=quality,
        t_request=now - 2e-3,
        t_receive=now,
        t_sample=now - DELAY,
        t_uncertainty=1e-3,
    )
    for listener in tuple(cell.listeners):
        listener(reading)


def angle(time: float) -> float:
    return 3 * time


def tension(time: float) -> float:
    return 200 + 10 * math.sin(time)


@contextmanager
def recording(
    path: Path,
    winches: str = "AB",
    metadata: Mapping[str, str] | None = None,
    rotation: Rotation | None = None,
) -> Iterator[tuple[Fed, Recorder]]:
    clock = SetClock()
    fed = Fed(clock, winches)
    with Recorder(path, fed.sensors, clock, metadata or {}, rotation=rotation) as recorder:
        yield fed, recorder
