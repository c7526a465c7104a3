"""Commands run in this process against a simulated bench on a virtual CAN bus."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from bare_winches import bare_winches
from command_line import done
from winchkit.schema.simbench import SimBench
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench
from winchkit.sim.live.paced_clock import PacedClock

CLOCKS = (
    "winchkit.bench.open",
    "winchkit.bench.remote.cell_session",
    "winchkit.bench.drives.node_access",
    "winchkit.bench.emergency_stop",
)


@dataclass
class Served:
    """A simulated bench and the bench file that leads to it."""

    live: LiveBench
    file: Path

    def drive(self, name: str = "A") -> object:
        return self.live.winches[name].drive

    def number(self, index: int, sub: int = 0) -> int:
        """What an object of the drive of A really holds."""
        return self.live.winches["A"].drive.objects.number(index, sub)


def of_commands(simulated: Callable[..., Any], real: Callable[..., Any]) -> Callable[..., Any]:
    """A function of ``time``, simulated for the thread in which the commands run."""

    def call(*arguments: float) -> Any:
        here = threading.current_thread() is threading.main_thread()
        return (simulated if here else real)(*arguments)

    return call


@contextmanager
def served(
    folder: Path, winches: str = "A", *, paced: bool = False, bench: SimBench | None = None
) -> Iterator[Served]:
    """The shipped spiral bench without its instruments, with as many winches as asked for, or
    another ``bench``.

    In simulated time, or ``paced``: for what waits outside the simulated clock, on a socket or for
    the reply to an SDO request.
    """
    simulated = bench or bare_winches(winches, cycle=0.004 if len(winches) < 3 else 0.02)
    clock: PacedClock | SimulatedClock
    if paced:
        clock = PacedClock()
        opened = LiveBench(simulated, seed=1, clock=clock.simulation)
    else:
        clock = SimulatedClock()
        opened = LiveBench(simulated, seed=1, simulated_time=clock)
    with pytest.MonkeyPatch.context() as patch, opened as live:
        for module in CLOCKS:
            patch.setattr(f"{module}.MonotonicClock", lambda: clock)
        if not paced:
            patch.setattr("time.sleep", of_commands(clock.sleep, time.sleep))
            patch.setattr("time.monotonic", of_commands(clock.now, time.monotonic))
        yield Served(live, live.write_bench_file(folder / "bench.toml", replace=True))


def without_trip(bench: Served) -> Served:
    """The same bench, reset where a trip is latched."""
    if bench.file.with_suffix(".trip.json").exists():
        done("reset", "-b", bench.file)
    return bench


def length(bench: Served, winch: str = "A") -> float:
    """True cable length, m."""
    with bench.live.up_to_date():
        return bench.live.winches[winch].plant.cable_length
