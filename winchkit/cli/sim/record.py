"""``winchkit sim record``: a motion programme on a simulated bench, without buses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from winchkit.cli.core.command import Command
from winchkit.cli.core.messages import suggest_next
from winchkit.cli.core.options import PROGRAMME, SIM_BENCH, output_option
from winchkit.cli.core.output import echo_json, is_json, json_flag
from winchkit.cli.core.quantity_type import Quantity
from winchkit.cli.core.terminal import progress_bar
from winchkit.errors import UsageError

if TYPE_CHECKING:
    from winchkit.runs.run import Run
    from winchkit.schema.programme import Programme


@click.command(
    "record",
    cls=Command,
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
@click.option(
    "--rate",
    type=Quantity("frequency", example="50 Hz"),
    default="50 Hz",
    show_default=True,
    help="Sampling rate.",
)
@output_option(
    "Folder for the runs.",
    "DIR",
    "--out",
    default=".",
    show_default=True,
    type=click.Path(file_okay=False, path_type=Path),
)
@click.option(
    "--format", "suffix", default="csv", show_default=True, type=click.Choice(["csv", "mcap"])
)
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
    rate: str,
    output: Path,
    suffix: str,
    hidden: tuple[str, ...],
) -> None:
    """Run PROGRAMMEs on a simulated BENCH without buses; write one run per load and repeat.

    A PROGRAMME is a file, or a shipped name such as programme-demo.
    """
    from winchkit.catalog import find
    from winchkit.cli.core.quantities import quantity
    from winchkit.runs import write_run
    from winchkit.schema.read import read_programme, read_simbench
    from winchkit.sim.bench import hiding, profiles_of, programme_path
    from winchkit.sim.record import simulate

    declared = read_simbench(find("sim", bench))
    if hidden:
        declared = hiding(declared, hidden)
    profiles = profiles_of(declared)
    hertz = quantity(rate, "frequency")
    named = (*programmes, *more)
    if not named:
        raise UsageError(
            "no motion programme is given: name a file, or a shipped one such as programme-demo"
        )
    written: list[dict[str, object]] = []
    with progress_bar() as progress:
        for index, name in enumerate(named):
            programme = read_programme(programme_path(name))
            for run in simulate(declared, profiles, programme, seed=seed, rate=hertz):
                path = output / f"{run.name}.{suffix}"
                output.mkdir(parents=True, exist_ok=True)
                write_run(run, path)
                written.append(_entry(path, run, programme))
                done = index / len(named) if len(named) > 1 else None
                progress(f"{programme.name}: {path.name} written", done)
                if not is_json():
                    click.echo(path)
    if is_json():
        echo_json({"schema": 1, "bench": bench, "seed": seed, "runs": written})
    winches = declared.bench.winch
    words = ["-p", next(iter(winches.values())).profile]
    words += ["--winch", "all"] if len(winches) > 1 else []
    suggest_next("compare", sorted(str(entry["path"]) for entry in written), *words)


def _entry(path: Path, run: Run, programme: Programme) -> dict[str, object]:
    return {
        "path": str(path),
        "programme": programme.name,
        "load_mass": run.load_mass,
        "rows": len(run),
        "seconds": float(run.time[-1]),
    }
