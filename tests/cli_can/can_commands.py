"""Commands run in this process against a simulated bench on a virtual CAN bus."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from winchkit import catalog
from winchkit.cli import main
from winchkit.schema.read import read_simbench
from winchkit.sim.live.bench import LiveBench
from winchkit.sim.live.paced_clock import PacedClock

CLOCKS = (
    "winchkit.bench.bench",
    "winchkit.bench.drives.node_access",
    "winchkit.bench.emergency_stop",
)


def invoke(*arguments: object, text: str | None = None) -> Result:
    """A command line; its output and exit code."""
    return CliRunner().invoke(main, [str(item) for item in arguments], input=text)


@dataclass
class Served:
    """A simulated bench and the wiring file that leads to it."""

    live: LiveBench
    file: Path

    def drive(self, name: str = "A") -> object:
        return self.live.winches[name].drive

    def number(self, index: int, sub: int = 0) -> int:
        """What an object of the drive of A really holds."""
        return self.live.winches["A"].drive.objects.number(index, sub)


@contextmanager
def served(folder: Path, winches: str = "A") -> Iterator[Served]:
    """The shipped spiral bench without its instruments, with as many winches as asked for."""
    declared = read_simbench(catalog.find("sim", "spiral-bench"))
    one = declared.bench.winch["A"]
    bare = {
        name: replace(
            one,
            servo=replace(one.servo, node=number),
            cell=None,
            length=None,
            temperature=None,
        )
        for number, name in enumerate(winches, start=1)
    }
    bus = {"can": declared.bench.bus["can"]}
    bench = replace(declared.bench, winch=bare, bus=bus, cycle=0.004 if len(bare) < 3 else 0.02)
    truth = dict.fromkeys(bare, declared.truth["A"])
    clock = PacedClock()
    with pytest.MonkeyPatch.context() as patch:
        for module in CLOCKS:
            patch.setattr(f"{module}.MonotonicClock", lambda: clock)
        simulated = replace(declared, bench=bench, truth=truth)
        with LiveBench(simulated, seed=1, clock=clock.simulation) as live:
            yield Served(live, live.write_bench_file(folder / "bench.toml"))
