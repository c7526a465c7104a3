"""What a bench's instruments record of its runs: noise, an offset, files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from campaign.bench import Bench
from campaign.files import write_run
from campaign.truth import OUTPUTS, Hidden, show

__all__ = ["record"]

Array = NDArray[np.float64]
Random = np.random.Generator
_EDGE = 2


def record(random: Random, bench: Bench, hidden: Hidden, folder: Path) -> tuple[Path, ...]:
    """Write every run of a bench that hides something; paths in the order of the runs."""
    offset = random.normal(0, 0.02)
    paths = []
    for index, (run, number) in enumerate(zip(bench.situations, bench.programmes, strict=True)):
        ideal = show(bench.winch, run, hidden)
        time = run.time[:: run.every]
        channels = {"time": time, "motor_angle": run.motor_angle[:: run.every]}
        for output in OUTPUTS:
            noise = _noise(random, len(time), bench.noise[output], bench.colour)
            channels[output] = getattr(ideal, output) + noise
        channels["cable_length"] = channels["cable_length"] + offset
        if bench.load == "load":
            channels["load"] = ideal.load + random.normal(0, bench.noise["load"], len(time))
        if bench.measures_temperature:
            channels["temperature"] = run.temperature[:: run.every] + random.normal(
                0, 0.02, len(time)
            )
        metadata = {"programme": f"moves-{number}"}
        if bench.load == "mass":
            metadata["load_mass"] = f"{run.mass} kg"
        path = folder / f"run-{index}.csv"
        # At the last samples the physics' own differences are one-sided: no winch does that.
        write_run(path, {name: x[:-_EDGE] for name, x in channels.items()}, metadata)
        paths.append(path)
    return tuple(paths)


def _noise(random: Random, count: int, rms: float, colour: float) -> Array:
    """White noise, of which ``colour`` (a share of the power) is AR(1)."""
    white = random.normal(size=count)
    drive = random.normal(size=count) * np.sqrt(1 - 0.9**2)
    slow, y = [], float(random.normal())
    for d in drive.tolist():
        y = 0.9 * y + d
        slow.append(y)
    return np.asarray(rms * (np.sqrt(1 - colour) * white + np.sqrt(colour) * np.array(slow)))
