"""``winchkit add``: fit an effect and write it into a copy of a profile."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from winchkit.cli.core.completion import complete_effect
from winchkit.cli.core.messages import note
from winchkit.cli.core.options import RUN, output_option
from winchkit.cli.core.output import echo_json
from winchkit.cli.core.terminal import progress_bar
from winchkit.cli.model.options import (
    Asked,
    ManyValues,
    figures_option,
    html_option,
    json_option,
    model_options,
    page_title,
    suggest_with,
    write_figures,
    write_page,
)

if TYPE_CHECKING:
    from winchkit.diagnosis.add import Addition


@click.command(
    cls=ManyValues,
    examples=(
        "winchkit add cable-elongation-linear --fit demo-*.csv -p bench-spiral -o better.toml",
        "winchkit add motor-viscous --fit demo-*.csv -p better.toml -o next.toml --json",
    ),
)
@click.argument("effect", shell_complete=complete_effect)
@click.option(
    "--fit",
    "runs",
    multiple=True,
    required=True,
    metavar="RUN...",
    type=RUN,
    help="Runs to fit.",
)
@output_option("Profile to write.", "NEW.toml", required=True)
@model_options
@json_option
@html_option
@figures_option
def command(
    *,
    effect: str,
    runs: Sequence[str],
    output: str,
    asked: Asked,
    as_json: bool,
    html: str | None,
    figures: str | None,
) -> None:
    """Fit EFFECT together with those of a profile to runs, and write the new profile.

    Values that the profile has already are refitted with it; every value gets its standard
    deviation, the runs and the date.
    """
    from winchkit.cli.model.options import declared_profile, refuse_options
    from winchkit.diagnosis.add import fitted_addition
    from winchkit.diagnosis.write import write_addition

    declared, catalogue = declared_profile(asked.source), asked.catalogue
    refuse_options(declared, asked.band)
    names = [Path(run).name for run in runs]
    with progress_bar() as progress:
        own = asked.runs(runs, declared)
        progress(f"fitting {effect}", None)
        named = asked.placed(effect, declared)
        fitted = fitted_addition(named, own, declared, catalogue, asked.band)
    write_addition(asked.source, fitted.addition, names, Path(output))
    _tell(fitted.addition, output, as_json)
    if html:
        from winchkit.report.pages.pages import addition_html

        title = page_title(declared.name, runs, effect)
        page = addition_html(fitted, title, asked.profile, output, options=asked.options)
        write_page(html, page)
    if figures:
        from winchkit.report.pages.pages import addition_figures
        from winchkit.report.reproducibility import Command

        source = Command(fitted.regression.dataset, asked.profile).source
        write_figures(figures, addition_figures(fitted, source))
    suggest_with("compare", asked, runs, profile=output)


def _tell(addition: Addition, output: str, as_json: bool) -> None:
    note(f"written: {output}")
    if as_json:
        echo_json(addition.to_json())
        return
    from winchkit.report.text import addition_text

    click.echo(addition_text(addition))
