"""What a bench's instruments record of its runs: noise, an offset, files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from campaign.bench import Bench
from campaign.truth import OUTPUTS, Hidden, show
from winchkit.arrays import Array

UNITS = {
    "time": "s",
    "motor_angle": "rad",
    "motor_velocity": "rad/s",
    "motor_torque": "N m",
    "tension": "N",
    "load": "N",
    "cable_length": "m",
    "temperature": "degC",
}


def write_run(
    path: Path,
    channels: Mapping[str, Array],
    metadata: Mapping[str, str],
    units: Mapping[str, tuple[str, float]] = MappingProxyType({}),
    digits: int = 9,
) -> None:
    """Write one CSV: metadata lines, a header, rows; columns of a winch named ``A.tension``.

    Columns of ``units`` have another unit, given with its size in SI.
    """
    head = [f"# {key}: {value}" for key, value in metadata.items()]
    si = {name: (UNITS[name.rpartition(".")[2]], 1.0) for name in channels} | dict(units)
    head.append(",".join(f"{name} [{si[name][0]}]" for name in channels))
    table = np.column_stack([x / si[name][1] for name, x in channels.items()])
    with path.open("w", encoding="utf-8") as out:
        out.write("\n".join(head) + "\n")
        np.savetxt(out, table, fmt=f"%.{digits}g", delimiter=",")


Random = np.random.Generator
AR = 0.9
"""Coefficient of the coloured part of the noise."""
EDGE = 2
"""Last samples that are not recorded: the physics' own differences are one-sided there."""


@dataclass(frozen=True)
class Recording:
    """One run as a file has it: channels (n,), SI, the time first, and metadata."""

    channels: Mapping[str, Array]
    metadata: Mapping[str, str]


def record(random: Random, bench: Bench, hidden: Hidden, folder: Path) -> tuple[Path, ...]:
    """Write every run of a bench that hides something; paths in the order of the runs."""
    return record_several(random, {"": bench}, {"": hidden}, folder)


def record_several(
    random: Random, benches: Mapping[str, Bench], hidden: Mapping[str, Hidden], folder: Path
) -> tuple[Path, ...]:
    """Write every run of several winches, each by its name, into files that hold all of them."""
    return write(recordings(random, benches, hidden), folder)


def write(runs: Sequence[Recording], folder: Path) -> tuple[Path, ...]:
    """Write recordings as ``run-0.csv`` …; paths in their order."""
    paths = [folder / f"run-{index}.csv" for index in range(len(runs))]
    for run, path in zip(runs, paths, strict=True):
        write_run(path, run.channels, run.metadata)
    return tuple(paths)


def recordings(
    random: Random, benches: Mapping[str, Bench], hidden: Mapping[str, Hidden]
) -> list[Recording]:
    """Every run of several winches; channels of a winch with a name are ``A.tension``."""
    offsets = {name: random.normal(0, 0.02) for name in benches}
    first = next(iter(benches.values()))
    out = []
    for index, (run, number) in enumerate(zip(first.situations, first.programmes, strict=True)):
        channels = {"time": run.time[:: run.every]}
        for name, bench in benches.items():
            shown = _shown(random, bench, index, hidden[name], offsets[name])
            channels |= {
                f"{name}.{channel}" if name else channel: x for channel, x in shown.items()
            }
        if first.measures_temperature:
            channels["temperature"] = run.temperature[:: run.every] + random.normal(
                0, 0.02, len(channels["time"])
            )
        metadata = {"programme": f"moves-{number}"}
        if first.load == "mass":
            metadata["load_mass"] = f"{run.mass} kg"
        out.append(Recording({name: x[:-EDGE] for name, x in channels.items()}, metadata))
    return out


def _shown(
    random: Random, bench: Bench, index: int, hidden: Hidden, offset: float
) -> dict[str, Array]:
    """Measurements of one winch in a run."""
    run = bench.situations[index]
    ideal, channels = show(bench.winch, run, hidden), {"motor_angle": run.motor_angle[:: run.every]}
    count = len(channels["motor_angle"])
    for output in OUTPUTS:
        noise = instrument_noise(random, count, bench.noise[output], bench.colour)
        channels[output] = getattr(ideal, output) + noise
    channels["cable_length"] = channels["cable_length"] + offset
    if bench.load == "load":
        channels["load"] = ideal.load + random.normal(0, bench.noise["load"], count)
    return channels


def instrument_noise(random: Random, count: int, rms: float, colour: float) -> Array:
    """White noise, of which ``colour`` (a share of the power) is AR(1)."""
    white = random.normal(size=count)
    drive = random.normal(size=count) * np.sqrt(1 - AR**2)
    slow, y = [], float(random.normal())
    for d in drive.tolist():
        y = AR * y + d
        slow.append(y)
    return np.asarray(rms * (np.sqrt(1 - colour) * white + np.sqrt(colour) * np.array(slow)))
