"""``winchkit run``: executes a motion programme on a bench and logs it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from winchkit import wings
from winchkit.cli.bench.holding import until_rest
from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.early_checks import check_folder, check_winches
from winchkit.cli.core.messages import note, suggest_next
from winchkit.cli.core.options import (
    PROGRAMME,
    bench_option,
    dry_run_option,
    effects_option,
    format_option,
    runs_folder_option,
)
from winchkit.cli.core.output import json_flag, tell
from winchkit.cli.core.standard_input import forget_typed, is_standard_input
from winchkit.errors import UsageError

if TYPE_CHECKING:
    from winchkit.bench.direction import DirectionKeyword
    from winchkit.schema.programme import Programme, ProgrammeStep


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit run short.toml -b bench.toml -o runs",
        "winchkit run short.toml -b bench.toml --dry-run",
    ),
)
@click.argument("programme", type=PROGRAMME)
@bench_option
@runs_folder_option
@format_option
@click.option(
    "-y",
    "--yes",
    is_flag=True,
    help="Answer every question with yes; a simulated bench does what is asked.",
)
@click.option("--replace", is_flag=True, help="Write over earlier runs of that programme.")
@effects_option
@dry_run_option
@json_flag("Print what was written as JSON.")
def command(
    programme: str,
    *,
    bench: str,
    output: Path,
    suffix: str,
    yes: bool,
    replace: bool,
    effects: Sequence[str],
    dry_run: bool,
) -> None:
    """Execute PROGRAMME (a file, or a shipped name) on a bench, one log per load and repeat.

    A robot programme moves the platform of the bench's robot; its whole path is compared with all
    limits before anything moves, with --dry-run only that.

    Ctrl-C, a trip or a fault stops the winches; what was logged until then is kept.
    """
    from winchkit.schema.read import load, read_bench, read_programme
    from winchkit.sim.bench import programme_path

    path = programme_path(programme)
    value = load(path).value
    if (by_wing := wings.call("run_command", value)) is not None:
        by_wing(value, bench, effects, output, f".{suffix}", replace=replace, dry_run=dry_run)
        return
    declared = read_programme(path)
    if is_standard_input(programme) and not yes and any(step.ask for step in declared.step):
        raise UsageError(
            "PROGRAMME -: it asks an operator, whose answers would come from standard input as "
            "well; give -y"
        )
    wired = read_bench(bench)
    check_winches(declared, wired)
    check_folder(output)
    if dry_run:
        _rehearse(bench, declared, effects)
        return
    if not replace:
        _refuse_to_lose(declared, output, f".{suffix}")
    ask = partial(_agree, bench) if yes else _ask
    written = _execute(bench, effects, declared, output, f".{suffix}", ask, replace=replace)
    tell({"programme": declared.name, "runs": written}, map(str, written))
    winches = wired.winch
    words = ["-p", next(iter(winches.values())).profile]
    words += ["--winch", "all"] if len(winches) > 1 else []
    suggest_next("compare", sorted(map(str, written)), *words)


def _execute(
    bench: str,
    effects: Sequence[str],
    programme: Programme,
    out: Path,
    suffix: str,
    ask: Callable[[ProgrammeStep], None],
    *,
    replace: bool,
) -> list[Path]:
    """Run it as the bench's owner; other commands may attach meanwhile."""
    from winchkit.bench.open import open_bench
    from winchkit.bench.programme import run_programme
    from winchkit.bench.remote.identity import client_name

    def report(repeat: int, number: int, step: ProgrammeStep) -> None:
        place = f"{programme.name} {repeat}/{programme.repeat}, step {number}"
        note(f"{place}: {step.words}")

    name = client_name("run")
    with open_bench(bench, effect_files=effects, name=name, realtime="try") as opened:
        return run_programme(
            opened, programme, out, ask, suffix=suffix, progress=report, replace=replace
        )


def _refuse_to_lose(programme: Programme, out: Path, suffix: str) -> None:
    """Raise UsageError where runs of an earlier time would be written over."""
    from winchkit.bench.programme import earlier_runs

    if held := earlier_runs(programme, out, suffix):
        raise click.UsageError(
            f"{held[0]} holds an earlier run of '{programme.name}'; "
            "name another folder with -o, or --replace."
        )


def _rehearse(bench: str, programme: Programme, effects: Sequence[str]) -> None:
    """Make the moves of one repeat on simulated drives, leaving out holds and questions."""
    from winchkit.bench.direction import directed
    from winchkit.cli.core.dry_run import station_for

    with station_for(bench, client="run", dry_run=True, effects=effects) as station:
        for step in programme.step:
            if step.to is None and not step.by:
                continue
            change: DirectionKeyword = {} if step.by is None else directed(step.by)
            station.move(
                step.winch,
                to=step.to,
                **change,
                speed=step.speed,
                acceleration=step.acceleration,
            )
            until_rest(station, step.winch)


def _ask(step: ProgrammeStep) -> None:
    forget_typed()
    click.confirm(f"{step.ask}; done?", default=True, abort=True, err=True)


def _agree(bench: str, step: ProgrammeStep) -> None:
    """Say yes; where the bench is simulated, let the simulation do what is asked."""
    from winchkit.sim.live.client import answer

    done = answer(bench, step)
    click.echo(f"{step.ask}: {'done by the simulation' if done else 'yes'}", err=True)
