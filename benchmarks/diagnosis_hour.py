"""What a diagnosis of a long recording of several winches costs, and whether it is right; JSON.

``python benchmarks/diagnosis_hour.py``: 60 minutes at 1 kHz of 8 winches, a programme of 30 minutes
and its repeat, load measured. Every winch has an elastic cable and Coulomb friction of the motor,
simulated by the campaign's own physics. The promise is 60 s after reading and 4 GB; exits 1 when it
is not kept or an effect is not named. ``--minutes 4 --winches 1`` is small enough for CI;
``--full`` diagnoses the first winch a second time with every sample, to compare; ``--csv FOLDER``
writes the recording, reads it back and times the reading.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter, process_time

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from scipy.signal import oaconvolve

from campaign.truth import Situation, show
from campaign.winch import Winch, turns_for, write_profile
from winchkit.arrays import Array
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.results import Diagnosis
from winchkit.effects import load_catalogue
from winchkit.fleet.diagnosis.diagnose import diagnose_each
from winchkit.runs import read_run
from winchkit.runs.run import Channel, Run
from winchkit.schema.read import read_profile

RATE = 1000.0
WINCH = Winch("grooved", 0.06, 5e-3, 20.4, 1, 0.0, 6.0, 5.0, 1.5, 90.0, (90.0, 60.0), 0.0)
NOISE = {
    "motor_angle": 1e-4,
    "cable_length": 3e-4,
    "tension": 0.8,
    "load": 0.8,
    "motor_torque": 5e-3,
}
UNITS = {
    "motor_angle": "rad",
    "cable_length": "m",
    "tension": "N",
    "load": "N",
    "motor_torque": "N m",
}
MASSES = (10.0, 24.0, 16.0, 32.0)
STIFFNESS = 1.5e5
RUBBING = 0.08
LIMIT = 60.0
MEMORY = 4000.0


def hidden(index: int) -> dict[str, dict[str, float]]:
    """What one of the winches hides: not two alike."""
    return {
        "cable-elongation-linear": {"axial_stiffness": STIFFNESS * (1 + 0.1 * index)},
        "motor-coulomb": {"torque": RUBBING * (1 + 0.1 * index)},
    }


def motion(random: np.random.Generator, seconds: float) -> tuple[Array, Array]:
    """Time (s) and cable wound in (m): moves between random places at 0.05 to 0.5 m/s, rests."""
    count = round(seconds * RATE)
    speed, at, place = np.zeros(count), round(RATE), 0.0
    while at < count:
        goal = -float(random.uniform(0.0, 4.0))
        fast = float(np.exp(random.uniform(np.log(0.05), np.log(0.5))))
        length = max(1, round(abs(goal - place) / fast * RATE))
        speed[at : at + length] = np.sign(goal - place) * fast
        place += float(np.sign(goal - place)) * fast * length / RATE
        at += length + round(RATE * float(random.choice([0.5, 1.0, 3.0])))
    bell = np.hanning(round(0.4 * RATE))
    smooth = oaconvolve(speed, bell / bell.sum(), mode="same")
    wound = np.concatenate([[0.0], np.cumsum((smooth[1:] + smooth[:-1]) / 2)]) / RATE
    return np.arange(count) / RATE, wound


def recordings(minutes: float, winches: int, seed: int = 1) -> list[Run]:
    """A run of all winches, named A, B …, of half that time, and its repeat with other noise."""
    random = np.random.default_rng(seed)
    channels: tuple[dict[str, Channel], ...] = ({}, {})
    time = np.zeros(0)
    for index in range(winches):
        time, wound = motion(random, 30 * minutes)
        angle = WINCH.ratio * turns_for(WINCH, 1.0) * wound
        mass = np.array(MASSES)[np.arange(len(time)) * len(MASSES) // len(time)]
        # The campaign's winches carry one weight a run; its physics takes a weight per sample too.
        run = Situation(time, angle, mass, np.full_like(time, 20.0), np.zeros_like(time))  # type: ignore[arg-type]
        shown = show(WINCH, run, hidden(index))
        ideal = {"motor_angle": angle} | {name: getattr(shown, name) for name in list(UNITS)[1:]}
        for own in channels:
            for name, values in ideal.items():
                noise = NOISE[name] * random.standard_normal(len(time))
                own[f"{chr(65 + index)}.{name}"] = Channel(values + noise, UNITS[name])
    return [Run(f"half-hour-{n}", time, own) for n, own in enumerate(channels, start=1)]


def written(run: Run, path: Path) -> None:
    """Write a run as CSV, a block of rows at a time."""
    with path.open("w", encoding="utf-8") as file:
        cells = ["time [s]", *(f"{name} [{c.unit}]" for name, c in run.channels.items())]
        file.write(",".join(cells) + "\n")
        columns = [run.time, *(channel.values for channel in run.channels.values())]
        for start in range(0, len(run), 10_000):
            block = np.column_stack([column[start : start + 10_000] for column in columns])
            np.savetxt(file, block, fmt="%.9g", delimiter=",")


def through_files(runs: list[Run], folder: Path) -> tuple[list[Run], dict[str, float]]:
    """Runs written and read back, and what reading costs."""
    paths = [folder / f"{run.name}.csv" for run in runs]
    for run, path in zip(runs, paths, strict=True):
        written(run, path)
    size = sum(path.stat().st_size for path in paths) / 1e6
    before, begun = peak(), perf_counter()
    back = [read_run(path) for path in paths]
    seconds = perf_counter() - begun
    cost = {"csv_mb": size, "seconds": seconds, "peak_before": before, "peak_after": peak()}
    return back, cost


def peak() -> float:
    """Most memory of this process so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def told(found: Diagnosis, index: int) -> dict[str, object]:
    """What was named on one winch, and how far its values are from the truth."""
    apart = {}
    for step in found.steps:
        for effect, values in hidden(index).items():
            if step.effects[0] == effect:
                name, true = next(iter(values.items()))
                estimate = step.parameters[effect][name]
                apart[effect] = {
                    "value": estimate.value,
                    "std": estimate.std,
                    "true": true,
                    "deviations": (estimate.value - true) / estimate.std,
                }
    return {
        "verdict": found.verdict,
        "named": [step.effects for step in found.steps],
        "values": apart,
        "notes": [note for note in found.notes if "sample of the runs" in note],
    }


def is_right(answers: Sequence[dict[str, object]]) -> bool:
    """Whether every winch's effects were named, and nothing else."""
    return all(
        sorted(effects[0] for effects in answer["named"]) == sorted(hidden(0))  # type: ignore[attr-defined]
        for answer in answers
    )


def main() -> int:
    """Make, diagnose every winch, print, judge."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--winches", type=int, default=8)
    parser.add_argument("--full", action="store_true", help="the first winch with every sample too")
    parser.add_argument("--csv", type=Path, metavar="FOLDER", help="through a CSV file there")
    args = parser.parse_args()
    folder = args.csv or Path(tempfile.mkdtemp())
    write_profile(WINCH, folder / "hour.toml")
    profile = read_profile(folder / "hour.toml")
    runs: list[Run] = recordings(args.minutes, args.winches)
    read: dict[str, float] = {}
    if args.csv:
        runs, read = through_files(runs, folder)
    begun, worked = perf_counter(), process_time()
    of_winch = {name: [run.of_winch(name) for run in runs] for name in runs[0].winches()}
    each = diagnose_each(of_winch, profile, load_catalogue())
    tellings = [told(answer.diagnosis, index) for index, (_, answer) in enumerate(each)]
    seconds, cpu = perf_counter() - begun, process_time() - worked
    result: dict[str, object] = {
        "schema": 1,
        "samples": [len(run) for run in runs],
        "winches": args.winches,
        "seconds": seconds,
        "cpu_seconds": cpu,
        "limit": LIMIT,
        "peak_memory_mb": peak(),
        "memory_limit_mb": MEMORY,
        "reading": read,
        "answers": tellings,
    }
    if args.full:
        begun = perf_counter()
        every = diagnose(of_winch["A"], profile, load_catalogue(), decimate=False).diagnosis
        result["every_sample"] = told(every, 0) | {"seconds": perf_counter() - begun}
    print(json.dumps(result, indent=1))
    return 0 if seconds <= LIMIT and peak() <= MEMORY and is_right(tellings) else 1


if __name__ == "__main__":
    sys.exit(main())
