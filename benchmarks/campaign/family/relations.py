"""Metamorphic relations: the same physics in other files, of which the same must be reported.

A relation changes what is recorded of a base case, or how it is written. ``exact`` ones leave all
information as it is; ``more`` add information; ``same`` have other noise or less data.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from campaign.family.base import Base
from campaign.record import Recording, write_run
from campaign.winch import Winch, write_profile
from winchkit.arrays import Array

Random = np.random.Generator
DAY = 86_400.0
UNITS = {
    "time": ("ms", 1e-3),
    "motor_angle": ("deg", np.pi / 180),
    "motor_torque": ("mN m", 1e-3),
    "tension": ("kN", 1e3),
    "cable_length": ("mm", 1e-3),
}
DIGITS = 15
"""Of all values: a nanosecond after a day."""


@dataclass(frozen=True)
class Files:
    """Recordings and a profile as they are written."""

    runs: Sequence[Recording]
    winch: Winch
    name: str = "run-{}"
    order: Sequence[int] = ()
    """In which the files are given; all in turn where empty."""
    units: Mapping[str, tuple[str, float]] = field(default_factory=dict)


def write_files(files: Files, folder: Path) -> tuple[list[Path], Path]:
    """Write; paths of the runs in the order in which they are given, and of the profile."""
    folder.mkdir(parents=True, exist_ok=True)
    profile = folder / "winch.toml"
    write_profile(files.winch, profile)
    paths = [folder / f"{files.name.format(index)}.csv" for index in range(len(files.runs))]
    for run, path in zip(files.runs, paths, strict=True):
        write_run(path, run.channels, run.metadata, files.units, DIGITS)
    order = files.order or range(len(paths))
    return [paths[index] for index in order], profile


def _each(base: Base, change: Callable[[dict[str, Array]], dict[str, Array]]) -> Files:
    runs = [replace(run, channels=change(dict(run.channels))) for run in base.runs(2)]
    return Files(runs, base.machine.winch)


def _stamps(size: float) -> Callable[[Base, Random], Files]:
    def moved(base: Base, random: Random) -> Files:
        return _each(
            base,
            lambda run: (
                run | {"time": run["time"] + size * random.choice([-1.0, 1.0], len(run["time"]))}
            ),
        )

    return moved


def _a_day_later(base: Base, _: Random) -> Files:
    return _each(base, lambda run: run | {"time": run["time"] + DAY})


def _another_order(base: Base, random: Random) -> Files:
    runs = base.runs(2)
    order = [int(i) for i in random.permutation(len(runs))]
    return Files(runs, base.machine.winch, "9 lifts, number {}", order)


def _cut(repeats: int) -> Callable[[Base, Random], Files]:
    """One file of which the second half is in a file of its own."""
    return lambda base, random: _halves(base.runs(repeats), base.machine.winch, random)


def _halves(runs: list[Recording], winch: Winch, random: Random) -> Files:
    at = int(random.integers(len(runs)))
    count = len(runs[at].channels["time"])
    half = int(random.uniform(0.4, 0.6) * count)
    parts = [
        replace(runs[at], channels={name: x[rows] for name, x in runs[at].channels.items()})
        for rows in (slice(0, half), slice(half, count))
    ]
    return Files([*runs[:at], *parts, *runs[at + 1 :]], winch)


def _rows_of_three(base: Base, _: Random) -> Files:
    """Every third row is missing."""
    return _each(base, lambda run: {name: x[np.arange(len(x)) % 3 != 2] for name, x in run.items()})


def _first_part(base: Base, _: Random) -> Files:
    return _each(base, lambda run: {name: x[: 2 * len(x) // 3] for name, x in run.items()})


def _another_unit(base: Base, random: Random) -> Files:
    name = str(random.choice(list(UNITS)))
    return Files(base.runs(2), base.machine.winch, units={name: UNITS[name]})


def _other_sign(base: Base, _: Random) -> Files:
    """The motor counts and pulls the other way, as the profile says."""
    turned = {"motor_angle", "motor_torque", "motor_velocity"}
    files = _each(base, lambda run: {name: -x if name in turned else x for name, x in run.items()})
    winch = base.machine.winch
    back = replace(winch, direction=-winch.direction, motor_reference=0.0 - winch.motor_reference)
    return replace(files, winch=back)


def _recorded(repeats: int) -> Callable[[Base, Random], Files]:
    return lambda base, _: Files(base.runs(repeats), base.machine.winch)


def _further_load(base: Base, _: Random) -> Files:
    return Files(base.runs(2, further=True), base.machine.winch)


def _another_noise(base: Base, _: Random) -> Files:
    return Files(base.runs(2, noise=1), base.machine.winch)


def _constant(base: Base, _: Random) -> Files:
    return _each(base, lambda run: run | {"temperature": np.full_like(run["time"], 20.0)})


@dataclass(frozen=True)
class Relation:
    """How the files of a case are changed."""

    files: Callable[[Base, Random], Files]
    exact: bool = False
    """Whether the same information is there, so that the same names must be certain."""
    of_size: bool = False
    """Whether names that are certain by little may become sets: other noise, less data."""


RELATIONS: Mapping[str, Relation] = {
    "twice": Relation(_recorded(2), exact=True),
    "stamps 1 ns": Relation(_stamps(1e-9), exact=True),
    "stamps 1 us": Relation(_stamps(1e-6), exact=True),
    "a day later": Relation(_a_day_later, exact=True),
    "other order and names": Relation(_another_order, exact=True),
    "another unit": Relation(_another_unit, exact=True),
    "sign and direction": Relation(_other_sign, exact=True),
    "constant channel": Relation(_constant, exact=True),
    "file cut in two": Relation(_cut(2)),
    "once, cut in two": Relation(_cut(1), of_size=True),
    "two rows of three": Relation(_rows_of_three, of_size=True),
    "first two thirds": Relation(_first_part, of_size=True),
    "once": Relation(_recorded(1), of_size=True),
    "three times": Relation(_recorded(3)),
    "a further load": Relation(_further_load),
    "another noise": Relation(_another_noise, of_size=True),
}
"""The first is the base that all others are compared with."""
