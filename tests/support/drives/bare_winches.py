"""The shipped spiral bench without its instruments, with as many winches as a test asks for."""

from __future__ import annotations

from dataclasses import replace

from winchkit import find, read_simbench
from winchkit.schema.simbench import SimBench


def bare_winches(names: str, *, cycle: float = 0.004, heartbeat: float | None = None) -> SimBench:
    """One drive for each name; ``cycle`` and ``heartbeat`` in s."""
    sim = read_simbench(find("sim", "spiral-bench"))
    one = sim.bench.winch["A"]
    winches = {
        name: replace(
            one, servo=replace(one.servo, node=number), cell=None, length=None, temperature=None
        )
        for number, name in enumerate(names, start=1)
    }
    can = sim.bench.bus["can"]
    bus = {"can": can if heartbeat is None else replace(can, heartbeat=heartbeat)}
    bench = replace(sim.bench, winch=winches, bus=bus, cycle=cycle)
    return replace(sim, bench=bench, truth=dict.fromkeys(winches, sim.truth["A"]))
