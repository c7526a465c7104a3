"""``winchkit remove``: take an effect out of a copy of a profile."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from winchkit.cli.core.completion import complete_effect_of_profile
from winchkit.cli.core.messages import note, suggest_next
from winchkit.cli.core.options import RUN, output_option
from winchkit.cli.core.output import echo_json
from winchkit.cli.core.terminal import progress_bar
from winchkit.cli.model.options import (
    Asked,
    ManyValues,
    json_option,
    model_options,
    suggest_with,
)

if TYPE_CHECKING:
    from winchkit.diagnosis.add import Removal


@click.command(
    cls=ManyValues,
    examples=(
        "winchkit remove cable-elongation-linear -p better.toml -o without.toml",
        "winchkit remove motor-viscous --fit demo-*.csv -p both.toml -o better.toml",
    ),
)
@click.argument("effect", shell_complete=complete_effect_of_profile)
@click.option(
    "--fit",
    "runs",
    multiple=True,
    metavar="RUN...",
    type=RUN,
    help="Runs to refit the others on.",
)
@output_option("Profile to write.", "NEW.toml", required=True)
@model_options
@json_option
def command(effect: str, runs: Sequence[str], output: str, asked: Asked, as_json: bool) -> None:
    """Write a profile without EFFECT; with --fit the other effects are refitted.

    A robot's effect on one line is EFFECT/LINE, or EFFECT with --winch LINE. The ledger records the
    step, and 'winchkit undo' takes it back.
    """
    from winchkit.cli.model.options import declared_profile, refuse_options
    from winchkit.diagnosis.add import remove
    from winchkit.diagnosis.write import write_removal

    declared, removal = declared_profile(asked.source), None
    refuse_options(declared, asked.band)
    effect = asked.placed(effect, declared)
    with progress_bar() as progress:
        progress("fitting", None)
        if runs:
            own = asked.runs(runs, declared)
            removal = remove(effect, own, declared, asked.catalogue, asked.band)
    names = [Path(run).name for run in runs]
    write_removal(asked.source, effect, removal, names, output)
    note(f"written: {output}")
    _tell(effect, removal, as_json)
    if runs:
        suggest_with("compare", asked, runs, profile=output)
    else:
        suggest_next("ledger", "-p", output)


def _tell(effect: str, removal: Removal | None, as_json: bool) -> None:
    if as_json:
        nothing = {"schema": 1, "effect": effect, "outputs": {}, "parameters": {}, "notes": []}
        echo_json(nothing if removal is None else removal.to_json())
    elif removal is not None:
        from winchkit.report.text import addition_text

        click.echo(addition_text(removal))
