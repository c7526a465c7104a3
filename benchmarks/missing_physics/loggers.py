"""Faults of loggers: rounding, jitter of the stamps, gaps, spikes, held values, zeros."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from missing_physics.machine import Array, Machine, Random

Table = dict[str, Array]
COLOUR = 0.9
"""Coefficient of the coloured part of an instrument's noise, from sample to sample."""


def instrument_noise(random: Random, count: int, rms: float, colour: float) -> Array:
    """White noise, of which ``colour`` (a share of the power) is AR(1)."""
    drive, slow = random.normal(size=count).tolist(), [float(random.normal())]
    for x in drive[1:]:
        slow.append(COLOUR * slow[-1] + np.sqrt(1 - COLOUR**2) * x)
    white = random.normal(size=count)
    return rms * (np.sqrt(1 - colour) * white + np.sqrt(colour) * np.asarray(slow))


def rounded(random: Random, machine: Machine, runs: list[Table]) -> list[Table]:
    """One output in steps of two to six times its noise."""
    output = str(random.choice(machine.outputs))
    step = machine.noise[output] * random.uniform(2, 6)
    return [run | {output: np.round(run[output] / step) * step} for run in runs]


def jittered(random: Random, _machine: Machine, runs: list[Table]) -> list[Table]:
    """Samples at even instants whose stamps are late or early by up to 40 % of an interval."""
    part = random.uniform(0.05, 0.4)
    interval = float(runs[0]["time"][1] - runs[0]["time"][0])
    return [
        run | {"time": run["time"] + part * interval * random.uniform(-1, 1, len(run["time"])) / 2}
        for run in runs
    ]


def gappy(random: Random, _machine: Machine, runs: list[Table]) -> list[Table]:
    """Every 10 s a gap of up to 1 s, and 2 % of the other samples lost."""
    out = []
    for run in runs:
        time = run["time"]
        keep = random.random(len(time)) > 0.02
        for start in np.arange(random.uniform(1, 5), time[-1] - 2, 10):
            keep &= (time < start) | (time > start + random.uniform(0.2, 1.0))
        out.append({name: x[keep] for name, x in run.items()})
    return out


def spiky(random: Random, machine: Machine, runs: list[Table]) -> list[Table]:
    """0.3 % of the samples of one output wrong by 30 to 1000 times the noise."""
    output = str(random.choice(machine.outputs))
    out = []
    for run in runs:
        hit = random.random(len(run["time"])) < 0.003
        size = machine.noise[output] * 10 ** random.uniform(1.5, 3, len(hit))
        sign = random.choice([-1, 1], len(hit))
        out.append(run | {output: np.where(hit, run[output] + sign * size, run[output])})
    return out


def held(random: Random, machine: Machine, runs: list[Table]) -> list[Table]:
    """One instrument is slower than the logger: its value stays for two to four samples."""
    output, times = str(random.choice(machine.outputs)), int(random.integers(2, 5))
    return [
        run | {output: run[output][np.arange(len(run["time"])) // times * times]} for run in runs
    ]


def zeroed(random: Random, machine: Machine, runs: list[Table]) -> list[Table]:
    """The length counter (of an axis the torque signal) has another zero in every run."""
    output = machine.outputs[0]
    spread = machine.noise[output] * 10 ** random.uniform(0.5, 1.5)
    return [run | {output: run[output] + random.normal(0, spread)} for run in runs]


LOGGERS: dict[str, Callable[[Random, Machine, list[Table]], list[Table]]] = {
    "rounded": rounded,
    "jittered": jittered,
    "gappy": gappy,
    "spiky": spiky,
    "held": held,
    "zeroed": zeroed,
}
