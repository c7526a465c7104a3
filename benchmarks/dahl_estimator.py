"""What the Dahl estimator and Dahl friction along a recording cost, side by side in one run.

``python benchmarks/dahl_estimator.py [--json] [--samples 1000000]``: one sample of the online
estimator over three pulleys, with its standard deviation, in plain Python and compiled; a million
samples at a constant limit with 1000 reversals and at a limit that changes; and how far the exact
step and Euler's are off at coarse steps. Promised: 20 us and 2 us a sample, 60 ms and 20 ms a
million at a constant limit. The compiled one is shown with numba (the ``fast`` extra);
exits with 1 when a promise is broken.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from importlib.util import find_spec
from math import pi
from time import perf_counter

import numpy as np

from winchkit.estimation import PLAIN, DahlEstimator, Kernels, PulleyGroup, compiled
from winchkit.estimation.dahl_batch import dahl_batch
from winchkit.model.friction import dahl, dahl_step

GROUP = PulleyGroup(
    (pi / 2, pi, pi / 2), 0.02, 2000.0, 1.3, ((1e-6, 0, 0), (0, 1e4, 0), (0, 0, 1e-2))
)
LIMITS = {
    "update, plain": 20e-6,
    "update, compiled": 2e-6,
    "constant limit, numpy": 60e-3,
    "constant limit, compiled": 20e-3,
}
ROUNDS = 5
UPDATES = 20_000
STIFFNESS, LIMIT = 3000.0, 20.0


def fastest_of(work: Callable[[], object]) -> float:
    """Seconds of the quickest of several rounds."""
    rounds = []
    for _ in range(ROUNDS):
        start = perf_counter()
        work()
        rounds.append(perf_counter() - start)
    return min(rounds)


def seconds_per_update(kernels: Kernels) -> float:
    """Of the online estimator, in motion."""
    estimator = DahlEstimator([GROUP], cell_std=1.0, kernels=kernels)
    wound = (0.05 * np.sin(np.linspace(0, 20 * pi, UPDATES))).tolist()

    def work() -> None:
        for position in wound:
            estimator.update(300.0, position)

    return fastest_of(work) / UPDATES


def stepwise(position: list[float], limit: float, shape: float) -> list[float]:
    """The exact step, sample after sample, as one writes it first."""
    force, before, out = 0.0, position[0], []
    for there in position:
        force = dahl_step(force, there - before, limit, STIFFNESS, shape)
        before = there
        out.append(force)
    return out


def seconds_per_recording(samples: int, kernels: Kernels | None) -> dict[str, float]:
    """Along a recording of ``samples`` with 1000 reversals."""
    way = 0.05 * np.sin(np.linspace(0, 1000 * pi, samples))
    changing = LIMIT + 5 * np.cos(np.linspace(0, 50, samples))
    listed, moved = way.tolist(), np.diff(way, prepend=way[:1])
    seconds = {
        "constant limit, loop": fastest_of(lambda: stepwise(listed, LIMIT, 1.0)),
        "constant limit, numpy": fastest_of(lambda: dahl_batch(way, LIMIT, STIFFNESS)),
        "constant limit, numpy, shape 1.3": fastest_of(
            lambda: dahl_batch(way, LIMIT, STIFFNESS, 1.3)
        ),
        "changing limit, numpy scan": fastest_of(lambda: dahl(way, changing, STIFFNESS)),
        "changing limit, loop, shape 1.3": fastest_of(lambda: dahl(way, changing, STIFFNESS, 1.3)),
    }
    if kernels is not None:
        out, constant = np.empty(samples), np.full(samples, LIMIT)
        for name, limit, shape in (
            ("constant limit, compiled", constant, 1.0),
            ("constant limit, compiled, shape 1.3", constant, 1.3),
            ("changing limit, compiled", changing, 1.0),
            ("changing limit, compiled, shape 1.3", changing, 1.3),
        ):
            seconds[name] = fastest_of(
                lambda most=limit, b=shape: kernels.forces(moved, most, STIFFNESS, b, 0.0, out)
            )
    return seconds


def coarse_errors() -> dict[str, float]:
    """Largest errors in N of a thousandfold coarser step than the truth's, F_c = 20 N."""
    fine = 0.05 * np.sin(np.linspace(0, 31.7 * pi, 600_001))
    truth = dahl_batch(fine, LIMIT, STIFFNESS)[::1000]
    moved = np.diff(fine[::1000], prepend=0.0)
    exact = euler = 0.0
    errors = np.zeros((len(moved), 2))
    for k, step in enumerate(moved.tolist()):
        exact = dahl_step(exact, step, LIMIT, STIFFNESS, 1.0)
        euler += STIFFNESS * step * (1 - euler / LIMIT * float(np.sign(step)))
        errors[k] = abs(exact - truth[k]), abs(euler - truth[k])
    return {"exact step": float(errors[:, 0].max()), "euler": float(errors[:, 1].max())}


def ratios(seconds: dict[str, float]) -> dict[str, float]:
    """How many times faster than plain Python, in the same run."""
    against = {
        "update, compiled": "update, plain",
        "constant limit, numpy": "constant limit, loop",
        "constant limit, compiled": "constant limit, loop",
        "changing limit, compiled": "changing limit, numpy scan",
        "changing limit, compiled, shape 1.3": "changing limit, loop, shape 1.3",
    }
    return {
        f"{name} / {other}": seconds[other] / seconds[name]
        for name, other in against.items()
        if name in seconds
    }


def main() -> int:
    """Measure, print, judge."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--samples", type=int, default=1_000_000)
    options = parser.parse_args()
    kernels, warm = None, float("nan")
    if find_spec("numba"):
        start = perf_counter()
        kernels, warm = compiled(), perf_counter() - start
    seconds = {"update, plain": seconds_per_update(PLAIN)}
    if kernels is not None:
        seconds["update, compiled"] = seconds_per_update(kernels)
    seconds |= seconds_per_recording(options.samples, kernels)
    scale = options.samples / 1_000_000
    broken = [
        name
        for name, limit in LIMITS.items()
        if name in seconds and seconds[name] > limit * (1 if "update" in name else scale)
    ]
    answer = {
        "schema": 1,
        "samples": options.samples,
        "seconds": seconds,
        "limits": LIMITS,
        "times_faster": ratios(seconds),
        "coarse_errors": coarse_errors(),
        "compile_seconds": warm if kernels else None,
        "broken": broken,
    }
    if options.json:
        print(json.dumps(answer))
    else:
        show(answer, seconds)
    return 1 if broken else 0


def show(answer: dict[str, object], seconds: dict[str, float]) -> None:
    """The same for people."""
    for name, value in seconds.items():
        unit, size = ("us", 1e-6) if "update" in name else ("ms", 1e-3)
        limit = f"  (promised {LIMITS[name] / size:g})" if name in LIMITS else ""
        print(f"{name:40} {value / size:9.2f} {unit}{limit}")
    for title in ("times_faster", "coarse_errors"):
        print(title.replace("_", " "))
        for name, value in answer[title].items():  # type: ignore[attr-defined]
            print(f"  {name:70} {value:8.2f}")
    print(
        f"compiled in {answer['compile_seconds']:.1f} s"
        if answer["compile_seconds"]
        else "numba is not installed: nothing compiled was measured"
    )


if __name__ == "__main__":
    sys.exit(main())
