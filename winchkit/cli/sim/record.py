"""``winchkit sim record``: a motion programme on a simulated bench, without buses."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from winchkit import wings
from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.messages import suggest_next
from winchkit.cli.core.options import (
    PROGRAMME,
    SIM_BENCH,
    format_option,
    quantity_option,
    replace_option,
    runs_folder_option,
)
from winchkit.cli.core.output import echo_json, is_json, json_flag
from winchkit.cli.core.terminal import progress_bar
from winchkit.errors import UsageError

if TYPE_CHECKING:
    from winchkit.runs.run import Run

_RATE = 50.0
"""Hz."""


@click.command(
    "record",
    cls=ToolCommand,
    examples=(
        "winchkit sim record demo-elastic-rope programme-demo -o runs",
        "winchkit sim record spiral-bench short.toml --seed 3 --hidden 'elastic rope'",
    ),
)
@click.argument("bench", type=SIM_BENCH)
@click.argument("programmes", nargs=-1, metavar="[PROGRAMME]...", type=PROGRAMME)
@click.option(
    "--programme",
    "more",
    multiple=True,
    metavar="PROGRAMME",
    type=PROGRAMME,
    help="Another motion programme, as PROGRAMME.",
)
@click.option("--seed", default=0, show_default=True, help="Seed of the noise.")
@quantity_option(
    "--rate",
    of="frequency",
    example="50 Hz",
    help=f"Sampling rate, by default {_RATE:g} Hz; a robot's log has the rows of its bench.",
)
@runs_folder_option
@format_option
@replace_option
@click.option(
    "--hidden",
    multiple=True,
    metavar="PHYSICS",
    help="Hide this instead of what the bench hides: a name of 'sim list --physics', also with "
    "numbers as 'elastic rope, axial_stiffness=80 kN', or 'none'. May be given several times.",
)
@json_flag("Print what was written as JSON.")
def command(
    *,
    bench: str,
    programmes: tuple[str, ...],
    more: tuple[str, ...],
    seed: int,
    rate: str | None,
    output: Path,
    suffix: str,
    replace: bool,
    hidden: tuple[str, ...],
) -> None:
    """Run PROGRAMMEs on a simulated BENCH without buses; write one run per load and repeat.

    A PROGRAMME is a file, or a shipped name such as programme-demo. A robot programme moves the
    platform of a robot by its bench, with buses, in simulated time.
    """
    from winchkit.catalog import find
    from winchkit.cli.core.quantities import quantity
    from winchkit.runs import read_run
    from winchkit.schema.read import load, read_programme, read_simbench
    from winchkit.sim.bench import hiding, profiles_of, programme_path
    from winchkit.sim.record import simulate

    declared = read_simbench(find("sim", bench))
    if hidden:
        declared = hiding(declared, hidden)
    profiles = profiles_of(declared)
    hertz = _RATE if rate is None else quantity(rate, "frequency")
    named = (*programmes, *more)
    if not named:
        raise UsageError(
            "no motion programme is given: name a file, or a shipped one such as programme-demo"
        )
    written: list[dict[str, object]] = []
    with progress_bar() as progress:
        for index, name in enumerate(named):
            path, done = programme_path(name), index / len(named) if len(named) > 1 else None
            value: Any = load(path).value
            runs: Iterable[tuple[Path, Run]]
            if (of_wing := wings.call("record", value)) is not None:
                if rate is not None:
                    raise UsageError(
                        "--rate is of winches; a robot's log has the rows of its bench"
                    )

                def tell(what: str, share: float | None = done) -> None:
                    progress(what, share)

                found = of_wing(
                    value, declared, output, f".{suffix}", seed=seed, tell=tell, replace=replace
                )
                runs = ((file, read_run(file)) for file in found)
            else:
                value = read_programme(path)
                made = simulate(declared, profiles, value, seed=seed, rate=hertz)
                runs = _written(made, output, suffix, replace=replace)
            for file, run in runs:
                written.append(_entry(file, run, value.name))
                progress(f"{value.name}: {file.name} written", done)
                if not is_json():
                    click.echo(file)
    if is_json():
        echo_json({"schema": 1, "bench": bench, "seed": seed, "runs": written})
    winches, robot = declared.bench.winch, declared.bench.robot
    words = ["-p", robot.profile if robot else next(iter(winches.values())).profile]
    words += ["--winch", "all"] if len(winches) > 1 and not robot else []
    suggest_next("compare", sorted(str(entry["path"]) for entry in written), *words)


def _written(
    runs: Iterable[Run], folder: Path, suffix: str, *, replace: bool
) -> Iterator[tuple[Path, Run]]:
    """Write runs as they are simulated; raises UsageError for one that exists."""
    from winchkit.runs import write_run

    for run in runs:
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f"{run.name}.{suffix}"
        write_run(run, path, replace=replace)
        yield path, run


def _entry(path: Path, run: Run, programme: str) -> dict[str, object]:
    return {
        "path": str(path),
        "programme": programme,
        "load_mass": run.load_mass,
        "rows": len(run),
        "seconds": float(run.time[-1]),
    }
