"""``winchkit add``, ``remove``, ``undo`` and ``ledger``: effects of a profile, and how it grew."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from winchkit.catalog import find
from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.completion import complete_effect, complete_effect_of_profile
from winchkit.cli.core.messages import note, suggest_next
from winchkit.cli.core.options import output_option, replace_option
from winchkit.cli.core.output import json_flag, tell
from winchkit.cli.core.standard_input import is_standard_input
from winchkit.cli.core.terminal import progress_bar
from winchkit.cli.model.options import (
    Asked,
    ManyValues,
    declared_profile,
    figures_option,
    fit_option,
    html_option,
    model_options,
    page_title,
    profile_option,
    refuse_options,
    suggest_with,
    write_figures,
    write_page,
)
from winchkit.errors import UsageError

if TYPE_CHECKING:
    from winchkit.diagnosis.add import Addition, Removal


@click.command(
    cls=ManyValues,
    examples=(
        "winchkit add cable-elongation-linear --fit demo-*.csv -p bench-spiral -o better.toml",
        "winchkit add motor-viscous --fit demo-*.csv -p better.toml -o next.toml --json",
    ),
)
@click.argument("effect", shell_complete=complete_effect)
@fit_option("Runs to fit.", required=True)
@output_option("Profile to write.", "NEW.toml", required=True)
@replace_option
@click.option(
    "--refit",
    type=click.Choice(["motion"]),
    help="Refit the values so that the measured torque makes the measured motion.",
)
@model_options
@json_flag("Print the answer as JSON.")
@html_option
@figures_option
def command(
    *,
    effect: str,
    runs: Sequence[str],
    output: str,
    replace: bool,
    refit: str | None,
    asked: Asked,
    html: str | None,
    figures: str | None,
) -> None:
    """Fit EFFECT together with those of a profile to runs, and write the new profile.

    Values that the profile has already are refitted with it; every value gets its standard
    deviation, the runs and the date. They predict the torque of a motion; with --refit motion they
    are refitted so that the motion simulated from the measured torque is the measured one, as a
    simulator needs them.
    """
    from winchkit.diagnosis.add import fitted_addition
    from winchkit.diagnosis.write import write_addition
    from winchkit.profile_edit.document import refuse_other

    refuse_other(Path(asked.source), Path(output), replace)
    declared, catalogue = declared_profile(asked.source), asked.catalogue
    refuse_options(declared, asked.band)
    names = [Path(run).name for run in runs]
    with progress_bar() as progress:
        own = asked.runs(runs, declared)
        progress(f"fitting {effect}", None)
        fitted = fitted_addition(
            asked.placed(effect, declared), own, declared, catalogue, asked.band,
            refit=refit, progress=lambda n: progress(f"refitting to the motion, step {n}", None),
        )  # fmt: skip
    write_addition(asked.source, fitted.addition, names, output, replace=replace)
    _tell(output, fitted.addition.to_json(), fitted.addition)
    if html:
        from winchkit.report.pages.pages import addition_html

        title = page_title(declared.name, runs, effect)
        page = addition_html(fitted, title, asked.profile, output, options=asked.options)
        write_page(html, page)
    if figures:
        from winchkit.report.pages.pages import addition_figures
        from winchkit.report.reproducibility import CommandLine

        source = CommandLine(fitted.regression.dataset, asked.profile).source
        write_figures(figures, addition_figures(fitted, source))
    suggest_with("compare", asked, runs, profile=output)


@click.command(
    cls=ManyValues,
    examples=(
        "winchkit remove cable-elongation-linear -p better.toml -o without.toml",
        "winchkit remove motor-viscous --fit demo-*.csv -p both.toml -o one.toml",
    ),
)
@click.argument("effect", shell_complete=complete_effect_of_profile)
@fit_option("Runs to refit the others on.")
@output_option("Profile to write.", "NEW.toml", required=True)
@replace_option
@model_options
@json_flag("Print the answer as JSON.")
def remove(effect: str, runs: Sequence[str], output: str, replace: bool, asked: Asked) -> None:
    """Write a profile without EFFECT; with --fit the other effects are refitted.

    A robot's effect on one line is EFFECT/LINE, or EFFECT with --winch LINE. The ledger records the
    step, and 'winchkit undo' takes it back.
    """
    from winchkit.diagnosis.add import remove as removed
    from winchkit.diagnosis.write import write_removal
    from winchkit.profile_edit.document import refuse_other

    refuse_other(Path(asked.source), Path(output), replace)
    declared, removal = declared_profile(asked.source), None
    refuse_options(declared, asked.band)
    effect = asked.placed(effect, declared)
    with progress_bar() as progress:
        progress("fitting", None)
        if runs:
            own = asked.runs(runs, declared)
            removal = removed(effect, own, declared, asked.catalogue, asked.band)
    names = [Path(run).name for run in runs]
    write_removal(asked.source, effect, removal, names, output, replace=replace)
    nothing = {"schema": 1, "effect": effect, "outputs": {}, "parameters": {}, "notes": []}
    _tell(output, nothing if removal is None else removal.to_json(), removal)
    if runs:
        suggest_with("compare", asked, runs, profile=output)
    else:
        suggest_next("ledger", "-p", output)


def _tell(output: str, data: dict[str, Any], fitted: Addition | Removal | None) -> None:
    from winchkit.report.text import addition_text

    note(f"written: {output}")
    tell(data, [] if fitted is None else [addition_text(fitted)])


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit ledger -p better.toml",
        "winchkit ledger -p better.toml --html ledger.html",
    ),
)
@profile_option
@json_flag("Print the ledger as JSON.")
@html_option
def ledger(profile: str, html: str | None) -> None:
    """List every effect that was added to or removed from a profile, and the errors then."""
    from winchkit.profile_edit import history
    from winchkit.report.pages.history import history_html, history_text

    declared = declared_profile(find("profiles", profile))
    steps = history.ledger(declared)
    told = {"profile": declared.name, "steps": [step.to_json() for step in steps]}
    tell(told, [history_text(declared.name, steps)])
    if html:
        write_page(html, history_html(declared.name, steps))


@click.command(
    cls=ToolCommand,
    examples=("winchkit undo -p better.toml", "winchkit undo -p better.toml -o before.toml"),
)
@profile_option
@output_option("Profile to write; else the same file.", "NEW.toml")
@replace_option
def undo(profile: str, output: str | None, replace: bool) -> None:
    """Undo the last 'add' or 'remove'; the values that it refitted are restored too."""
    from winchkit.profile_edit.ledger import undo as undone

    if output is None and is_standard_input(profile):
        raise UsageError("-p -: a profile from standard input is written to a file with -o")
    source = find("profiles", profile)
    declared_profile(source)
    if output is None and source != Path(profile):
        raise UsageError(f"'{profile}' ships with winchkit; write the copy to a file with -o")
    done = undone(source, Path(output or source), replace=replace)
    click.echo(f"taken back: {done}")
    suggest_next("ledger", "-p", output or profile)
