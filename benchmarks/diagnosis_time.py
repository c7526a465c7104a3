"""How long a diagnosis of six runs takes, and how much memory; prints JSON, exits 1 when too slow.

``python benchmarks/diagnosis_time.py``: three loads, two repeats each, 180 s at 50 Hz, three
outputs, the whole catalogue, recorded on a simulated bench that hides something. The promise is
3 s on two cores and 500 MB; reading and recording are not counted.
"""

from __future__ import annotations

import argparse
import cProfile
import json
import pstats
import resource
import sys
from dataclasses import replace
from time import perf_counter, process_time

from winchkit.catalog import find
from winchkit.diagnosis.diagnose import diagnose
from winchkit.effects import load_catalogue
from winchkit.runs.run import Run
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.programme import Programme, ProgrammeStep
from winchkit.schema.read import read_simbench
from winchkit.sim.bench import hiding, profiles_of
from winchkit.sim.record import simulate

SECONDS = 180.0
RATE = 50.0
LIMIT = 3.0
MEMORY = 500.0
"""MB, of the whole process at most."""
LOADS = (10.0, 16.0, 24.0)
STROKES = (
    (2.8, 0.5, 2.0),
    (1.0, 0.25, 2.0),
    (1.6, 0.05, 1.0),
    (1.5, 0.04, 1.0),
    (2.6, 0.4, 3.0),
    (0.8, 0.15, 2.0),
    (1.5, 0.5, 2.0),
)
"""Where to, m; how fast, m/s; how long it rests there, s."""


def programme() -> Programme:
    """Strokes of several speeds with rests and a slow reversal, under every load, twice."""
    steps = []
    for mass in LOADS:
        steps.append(ProgrammeStep(ask=f"hang the {mass:g} kg load", load_mass=mass))
        for to, speed, rest in 3 * STROKES:
            steps.append(ProgrammeStep(to=to, speed=speed, acceleration=0.8))
            steps.append(ProgrammeStep(hold=rest))
        steps.append(ProgrammeStep(hold=SECONDS))
    return Programme("long", tuple(steps), repeat=2)


def cut(run: Run, rows: int) -> Run:
    """The first rows of a run."""
    channels = {
        name: replace(channel, values=channel.values[:rows])
        for name, channel in run.channels.items()
    }
    return replace(run, time=run.time[:rows], channels=channels)


def recorded(hidden: str) -> tuple[list[Run], WinchProfile]:
    """The six runs, and the profile to compare them with."""
    bench = hiding(read_simbench(find("sim", "spiral-bench")), [hidden])
    profiles = profiles_of(bench)
    rows = round(SECONDS * RATE)
    runs = [cut(run, rows) for run in simulate(bench, profiles, programme(), seed=1, rate=RATE)]
    return runs, profiles["A"]


def main() -> int:
    """Record, measure, print, judge."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hidden", default="elastic rope", help="a name of 'sim list --physics'")
    parser.add_argument("--profile", action="store_true", help="where the time goes, on stderr")
    args = parser.parse_args()
    runs, profile = recorded(args.hidden)
    catalogue = load_catalogue()
    profiler = cProfile.Profile()
    start, worked = perf_counter(), process_time()
    if args.profile:
        profiler.enable()
    diagnosis = diagnose(runs, profile, catalogue).diagnosis
    profiler.disable()
    seconds, cpu = perf_counter() - start, process_time() - worked
    if args.profile:
        pstats.Stats(profiler, stream=sys.stderr).sort_stats("cumulative").print_stats(35)
    megabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    answer = {
        "schema": 1,
        "runs": len(runs),
        "samples": [len(run) for run in runs],
        "outputs": list(diagnosis.outputs),
        "effects": len(catalogue),
        "hidden": args.hidden,
        "verdict": diagnosis.verdict,
        "named": [step.effects for step in diagnosis.steps],
        "seconds": seconds,
        "cpu_seconds": cpu,
        "limit": LIMIT,
        "peak_memory_mb": megabytes,
        "memory_limit_mb": MEMORY,
    }
    print(json.dumps(answer))
    return 0 if seconds <= LIMIT and megabytes <= MEMORY else 1


if __name__ == "__main__":
    sys.exit(main())
