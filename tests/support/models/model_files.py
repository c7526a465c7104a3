"""Files of runs and effects that the tests of compare, diagnose and add share."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from command_line import done
from winchkit.catalog import find
from winchkit.runs import write_run
from winchkit.runs.run import Channel, Run
from winchkit.schema.read import read_programme, read_simbench
from winchkit.sim.bench import hiding, profiles_of, programme_path
from winchkit.sim.record import simulate

KINK = """\
import numpy as np

from winchkit.effects.effect import Effect, Parameter
from winchkit.model.stages import Stage


def apply(length, at, values):
    return length + values["height"] * np.exp(-(((at.free_length - 2.2) / 0.15) ** 2))


KINK = Effect(
    id="kinked-rope",
    stage=Stage.CABLE,
    parameters=(Parameter("height", "m", null=0.0, typical=1e-3),),
    apply=apply,
    outputs=("cable_length",),
    what="The cable has a kink.",
    formula="l + h exp(-((l - 2.2 m) / 0.15 m)^2)",
    source="the user's own eyes",
    looks_like="A bump at one length.",
    told_apart="Wind the cable the other way round.",
)
"""
"""A user's own effect, which no catalogue has."""
HEIGHT = 1.5e-3
SHIPPED = Path(__file__).parents[3] / "profiles" / "bench-spiral.toml"


def answer(*arguments: object) -> dict[str, Any]:
    """What a command prints with --json: one line and nothing besides."""
    result = done(*arguments, "--json")
    assert result.stdout.count("\n") == 1
    value = json.loads(result.stdout, parse_constant=_refused)
    assert isinstance(value, dict)
    return value


def _refused(constant: str) -> None:
    raise AssertionError(f"{constant} is no JSON")


def record_files(
    folder: Path,
    *physics: str,
    bench: str = "spiral-bench",
    change: Callable[[Run], Run] | None = None,
) -> list[Path]:
    """Runs of the demo's two programmes with physics hidden, changed before they are written."""
    declared = hiding(read_simbench(find("sim", bench)), physics)
    out = []
    for name in ("programme-demo-fast", "programme-demo-slow"):
        programme = read_programme(programme_path(name))
        runs = simulate(declared, profiles_of(declared), programme, seed=11)
        out += write_runs(folder, map(change, runs) if change else runs)
    return out


def write_runs(folder: Path, runs: Iterable[Run]) -> list[Path]:
    """Runs as files of their names."""
    paths = []
    for run in runs:
        paths.append(folder / f"{run.name}.csv")
        write_run(run, paths[-1])
    return paths


def kinked(run: Run) -> Run:
    """The run with a bump in its length, as the user's effect has it."""
    length = run["cable_length"]
    bump = HEIGHT * np.exp(-(((length - 2.2) / 0.15) ** 2))
    channel = Channel(length + bump, "m")
    return replace(run, channels={**run.channels, "cable_length": channel})


def side_by_side(first: Run, second: Run) -> Run:
    """Two runs of one motion as the winches A and B of one file."""
    rows = min(len(first), len(second))
    channels = {
        f"{winch}.{name}": Channel(channel.values[:rows], channel.unit)
        for winch, run in (("A", first), ("B", second))
        for name, channel in run.channels.items()
    }
    return Run("both", first.time[:rows], channels, dict(first.metadata))


def edited(lines: Sequence[str], row: int, column: int, text: str) -> list[str]:
    """Lines of a CSV with one cell changed."""
    out = list(lines)
    cells = out[row].split(",")
    cells[column] = text
    out[row] = ",".join(cells)
    return out
