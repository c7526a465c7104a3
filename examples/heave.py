"""A control program: the cable follows the heave of a ship, on a simulated bench in this process.

For a real bench only the first lines differ: ``with open_bench("bench.toml") as bench``.
"""

import math
from pathlib import Path

from winchkit import (
    Bench,
    BenchSnapshot,
    LiveBench,
    Run,
    SimulatedClock,
    find,
    open_bench,
    read_run,
    read_simbench,
)

PERIOD = 2.0
"""Period of the waves, s."""
AMPLITUDE = 0.05
"""Amplitude of the heave, m."""


def heave(bench: Bench, duration: float) -> None:
    """Wind in and pay out as the waves go; speeds returned keep the winch moving."""
    start = bench.clock.now()

    def follow(snapshot: BenchSnapshot) -> dict[str, float]:
        phase = 2 * math.pi * (snapshot.time - start) / PERIOD
        return {"A": AMPLITUDE * 2 * math.pi / PERIOD * math.sin(phase)}

    remove = bench.on_cycle(follow)
    bench.clock.sleep(duration)
    remove()
    bench.stop()


def main(path: str | Path = "heave.csv", duration: float = 2 * PERIOD) -> Run:
    """Heave for a while, log it, and say what the instruments saw."""
    clock = SimulatedClock()  # time advances as fast as the computer can
    declared = read_simbench(find("sim", "spiral-bench"))
    with (
        LiveBench(declared, simulated_time=clock) as simulated,
        open_bench(simulated.bench_spec, clock) as bench,
        bench.log(path),
    ):
        heave(bench, duration)
    run = read_run(path)
    length, tension = run["cable_length"], run["tension"]
    print(f"{Path(path).name}: {len(run)} rows")
    print(f"stroke {1e3 * (length.max() - length.min()):.0f} mm")
    print(f"tension {tension.min():.0f} to {tension.max():.0f} N")
    return run


if __name__ == "__main__":
    main()
