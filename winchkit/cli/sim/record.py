"""``winchkit sim record``: a motion programme on a simulated bench, without buses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from winchkit.cli.core.output import echo_json

if TYPE_CHECKING:
    from winchkit.runs.run import Run
    from winchkit.schema.programme import Programme

__all__ = ["command"]


@click.command("record")
@click.argument("bench")
@click.option(
    "-p",
    "--programme",
    "programmes",
    multiple=True,
    required=True,
    help="Motion programme: a file, or a shipped name such as programme-demo.",
)
@click.option("--seed", default=0, show_default=True, help="Of the noise.")
@click.option("--rate", default="50 Hz", show_default=True, help="Of the samples.")
@click.option(
    "--out",
    default=".",
    show_default=True,
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder for the runs.",
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
@click.option("--json", "as_json", is_flag=True, help="Print what was written as JSON.")
def command(
    *,
    bench: str,
    programmes: tuple[str, ...],
    seed: int,
    rate: str,
    out: Path,
    suffix: str,
    hidden: tuple[str, ...],
    as_json: bool,
) -> None:
    """Run programmes on a simulated BENCH without buses and write one run per load and repeat."""
    from winchkit.catalog import find
    from winchkit.cli.core.quantities import quantity
    from winchkit.runs import write_csv, write_mcap
    from winchkit.schema.read import read_programme, read_simbench
    from winchkit.sim.bench import hiding, profiles_of, programme_path
    from winchkit.sim.record import simulate

    declared = read_simbench(find("sim", bench))
    if hidden:
        declared = hiding(declared, hidden)
    profiles = profiles_of(declared)
    hertz = quantity(rate, "frequency")
    write = write_csv if suffix == "csv" else write_mcap
    written = []
    for name in programmes:
        programme = read_programme(programme_path(name))
        for run in simulate(declared, profiles, programme, seed=seed, rate=hertz):
            path = out / f"{run.name}.{suffix}"
            out.mkdir(parents=True, exist_ok=True)
            write(run, path)
            written.append(_entry(path, run, programme))
            if not as_json:
                click.echo(path)
    if as_json:
        echo_json({"schema": 1, "bench": bench, "seed": seed, "runs": written})


def _entry(path: Path, run: Run, programme: Programme) -> dict[str, object]:
    return {
        "path": str(path),
        "programme": programme.name,
        "load_mass": run.load_mass,
        "rows": len(run),
        "seconds": float(run.time[-1]),
    }
