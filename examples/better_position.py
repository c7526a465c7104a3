"""Position error of a winch before and after an effect is added to its profile.

A simulated bench has an effect that its profile lacks. Runs are recorded, the missing effect is
identified and added, and the winch moves to the same lengths with the original profile and with the
extended one. The position error is that of the cable's end in the simulation.

    python examples/better_position.py [BENCH [EFFECT]]
"""

import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from winchkit import (
    LiveBench,
    SimulatedClock,
    add,
    diagnose,
    find,
    open_bench,
    read_profile,
    read_programme,
    read_simbench,
    simulate,
    write_addition,
)
from winchkit.schema.bench import BenchSpec
from winchkit.schema.simbench import SimBench

LENGTHS = (3.0, 1.0, 2.0)
"""Cable lengths to go to, m."""


def position_errors(bench: SimBench, profile: str | Path, load: float | None = None) -> list[float]:
    """True less wanted cable length (m) after a move to each of ``LENGTHS``."""
    clock = SimulatedClock()
    errors = []
    with LiveBench(bench, simulated_time=clock) as simulated:
        if load is not None:
            simulated.hang("A", load)
        spec = _with_profile(simulated.bench_spec, str(profile))
        with open_bench(spec, clock) as opened:
            winch = opened.winch["A"]
            for length in LENGTHS:
                winch.move_to(length, speed=0.4)
                with simulated.up_to_date():
                    errors.append(simulated.winches["A"].plant.cable_length - length)
    return errors


def _with_profile(spec: BenchSpec, profile: str) -> BenchSpec:
    return replace(spec, winch={"A": replace(spec.winch["A"], profile=profile)})


def main(bench: str = "soft-frame", effect: str | None = None) -> tuple[float, float]:
    """Record, diagnose, add, move; returns rms position errors before and after, m."""
    declared = read_simbench(find("sim", bench))
    bare = find("profiles", declared.bench.winch["A"].profile)
    profile = read_profile(bare)
    programme = read_programme(str(Path(__file__).with_name("ladder.toml")))
    runs = list(simulate(declared, {"A": profile}, programme))
    found = diagnose(runs, profile)
    if effect is None:
        if found.diagnosis.verdict != "explained":
            raise SystemExit(f"{bench}: {found.diagnosis.verdict}; nothing to add")
        effect = found.diagnosis.steps[0].effects[0]
    with TemporaryDirectory() as folder:
        better = Path(folder) / "better.toml"
        write_addition(bare, add(effect, runs, profile), [run.name for run in runs], better)
        before, after = (_rms(position_errors(declared, path)) for path in (bare, better))
    print(f"{bench}: {effect}")
    print(f"position error before {1e3 * before:.2f} mm, after {1e3 * after:.2f} mm (rms)")
    return before, after


def _rms(errors: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))


if __name__ == "__main__":
    main(*sys.argv[1:])
