"""``winchkit compare``: how far a profile is from measured runs, and what the error follows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from winchkit import wings
from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.messages import is_verbose
from winchkit.cli.core.output import json_flag, tell
from winchkit.cli.core.terminal import progress_bar
from winchkit.cli.model.options import (
    Asked,
    declared_profile,
    figures_option,
    html_option,
    model_options,
    page_title,
    refuse_options,
    runs_argument,
    suggest_with,
    write_figures,
    write_page,
)
from winchkit.errors import UsageError

if TYPE_CHECKING:
    from winchkit.dynamics.comparison import SimulatedError


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit compare demo-*.csv -p bench-spiral",
        "winchkit compare demo-*.csv -p better.toml --html errors.html",
        "winchkit compare - -p bench-spiral < demo-10kg-1.csv",
    ),
)
@runs_argument
@model_options
@json_flag("Print the answer as JSON.")
@html_option
@figures_option
@click.option(
    "--forward", "is_simulated", is_flag=True, help="Also simulate the motion and compare it."
)
def command(
    *,
    runs: Sequence[str],
    asked: Asked,
    html: str | None,
    figures: str | None,
    is_simulated: bool,
) -> None:
    """Compare runs with a profile at its file values; only the length offset is fitted.

    With --forward the motion is simulated from the measured torque (open loop), and from a channel
    reference_angle by the loops of [control].
    """
    from winchkit.diagnosis.compare import WinchCompared, compared
    from winchkit.report.pages.pages import comparison_figures, comparison_html
    from winchkit.report.reproducibility import CommandLine
    from winchkit.report.simulated import simulated_figures, simulated_text
    from winchkit.report.text import compare_text
    from winchkit.schema.profiles.winch import WinchProfile

    declared = declared_profile(asked.source)
    refuse_options(declared, asked.band, asked.winch)
    if is_simulated and (asked.each or not isinstance(declared, WinchProfile)):
        which = "; choose one with --winch" if asked.each else ", not a robot"
        raise UsageError(f"--forward simulates one winch or axis{which}")
    if asked.each and isinstance(declared, WinchProfile):
        wings.part("fleet", "compare_command")(runs, declared, asked, html, figures)
        return
    with progress_bar() as progress:
        own = asked.runs(runs, declared)
        progress("comparing", None)
        answer = compared(own, declared, asked.catalogue, asked.band)
        errors: list[SimulatedError] = []
        if (
            is_simulated
            and isinstance(declared, WinchProfile)
            and isinstance(answer, WinchCompared)
        ):
            from winchkit.diagnosis.data.sanity import require_drive
            from winchkit.diagnosis.linear_axis import errors_in_units_of
            from winchkit.dynamics.comparison import simulated_errors

            with errors_in_units_of(declared):
                require_drive(answer.regression.dataset.sanity)
            progress("simulating the motion", None)
            errors = simulated_errors(own, declared, asked.catalogue)
    simulated = {"simulated": [error.to_json() for error in errors]} if errors else {}
    lines = [compare_text(answer.comparison, verbose=is_verbose())]
    if errors:
        lines.append("\n" + simulated_text(errors))
    tell({**answer.comparison.to_json(), **simulated}, lines)
    if html:
        title = page_title(declared.name, runs)
        write_page(html, comparison_html(answer, title, asked.profile, options=asked.options))
    if figures:
        source = CommandLine(answer.regression.dataset, asked.profile).source
        more = simulated_figures(answer, errors) if isinstance(answer, WinchCompared) else []
        write_figures(figures, [*comparison_figures(answer, source), *more])
    suggest_with("diagnose", asked, runs)
