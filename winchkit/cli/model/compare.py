"""``winchkit compare``: how far a profile is from measured runs, and what the error follows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from winchkit import wings
from winchkit.cli.core.command import Command
from winchkit.cli.core.messages import is_verbose
from winchkit.cli.core.output import echo_json
from winchkit.cli.core.terminal import progress_bar
from winchkit.cli.model.options import (
    Asked,
    figures_option,
    html_option,
    json_option,
    model_options,
    page_title,
    runs_argument,
    suggest_with,
    write_figures,
    write_page,
)

if TYPE_CHECKING:
    from winchkit.diagnosis.results import Comparison


@click.command(
    cls=Command,
    examples=(
        "winchkit compare demo-*.csv -p bench-spiral",
        "winchkit compare demo-*.csv -p better.toml --html errors.html",
        "winchkit compare - -p bench-spiral < demo-10kg-1.csv",
    ),
)
@runs_argument
@model_options
@json_option
@html_option
@figures_option
def command(
    runs: Sequence[str], asked: Asked, as_json: bool, html: str | None, figures: str | None
) -> None:
    """Compare runs with a profile at its file values; only the length offset is fitted."""
    from winchkit.cli.model.options import declared_profile, refuse_options
    from winchkit.diagnosis.compare import compared
    from winchkit.report.pages.pages import comparison_figures, comparison_html
    from winchkit.report.reproducibility import Command
    from winchkit.schema.profiles.winch import WinchProfile

    declared = declared_profile(asked.source)
    refuse_options(declared, asked.band, asked.winch)
    if asked.each and isinstance(declared, WinchProfile):
        wings.part("fleet", "compare_command")(runs, declared, asked, as_json, html, figures)
        return
    with progress_bar() as progress:
        own = asked.runs(runs, declared)
        progress("comparing", None)
        answer = compared(own, declared, asked.catalogue, asked.band)
    _tell(answer.comparison, as_json)
    if html:
        title = page_title(declared.name, runs)
        write_page(html, comparison_html(answer, title, asked.profile, options=asked.options))
    if figures:
        source = Command(answer.regression.dataset, asked.profile).source
        write_figures(figures, comparison_figures(answer, source))
    suggest_with("diagnose", asked, runs)


def _tell(comparison: Comparison, as_json: bool) -> None:
    if as_json:
        echo_json(comparison.to_json())
        return
    from winchkit.report.text import compare_text

    click.echo(compare_text(comparison, verbose=is_verbose()))
