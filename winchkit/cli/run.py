"""``winchkit run``: executes a motion programme on a bench and logs it."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from winchkit.cli.output import echo_json

if TYPE_CHECKING:
    from winchkit.schema.programme import Step

__all__ = ["command"]


@click.command()
@click.argument("programme")
@click.option("-b", "--bench", required=True, metavar="FILE", help="Wiring file of the bench.")
@click.option(
    "-o",
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
    "-y",
    "--yes",
    is_flag=True,
    help="Answer every question with yes; a simulated bench does what is asked.",
)
@click.option("--json", "as_json", is_flag=True, help="Print what was written as JSON.")
def command(programme: str, bench: str, out: Path, suffix: str, yes: bool, as_json: bool) -> None:
    """Execute PROGRAMME (a file, or a shipped name) on a bench, one log per load and repeat.

    Ctrl-C, a trip or a fault stops the winches; what was logged until then is kept.
    """
    from winchkit.bench.bench import open_bench
    from winchkit.bench.programme import run_programme
    from winchkit.bench.server import StationServer
    from winchkit.schema.read import read_programme
    from winchkit.sim.bench import programme_path

    declared = read_programme(programme_path(programme))
    with open_bench(bench) as opened:
        server = StationServer(opened)
        try:
            written = run_programme(
                opened,
                declared,
                out,
                partial(_agree, bench) if yes else _ask,
                suffix=f".{suffix}",
                progress=lambda repeat, number, step: click.echo(
                    f"{declared.name} {repeat}/{declared.repeat}, step {number}: {_words(step)}",
                    err=True,
                ),
            )
        finally:
            server.close()
    if as_json:
        echo_json({"schema": 1, "programme": declared.name, "runs": written})
    else:
        for path in written:
            click.echo(path)


def _ask(step: Step) -> None:
    click.confirm(f"{step.ask}; done?", default=True, abort=True, err=True)


def _agree(bench: str, step: Step) -> None:
    """Say yes; where the bench is simulated, let the simulation do what is asked."""
    from winchkit.sim.live_client import answer

    done = answer(bench, step)
    click.echo(f"{step.ask}: {'done by the simulation' if done else 'yes'}", err=True)


def _words(step: Step) -> str:
    if step.ask is not None:
        return f"ask: {step.ask}"
    if step.hold is not None:
        return f"hold {step.hold:g} s"
    where = f"to {step.to:g} m" if step.to is not None else f"by {step.by:g} m"
    return f"winch {step.winch} {where}"
