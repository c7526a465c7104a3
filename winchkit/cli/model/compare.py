"""``winchkit compare``: how far a profile is from measured runs, and what the error follows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from winchkit.cli.core.command import Command
from winchkit.cli.core.messages import note
from winchkit.cli.core.output import echo_each, echo_json
from winchkit.cli.core.terminal import progress_bar
from winchkit.cli.model.options import (
    Asked,
    figures_option,
    html_option,
    json_option,
    model_options,
    page_title,
    pages_beside,
    read_all,
    read_each,
    runs_argument,
    save_figures,
    save_page,
    suggest_with,
    write_figures,
    write_page,
)

if TYPE_CHECKING:
    from winchkit.diagnosis.results import Comparison
    from winchkit.schema.profiles.robot import RobotProfile
    from winchkit.schema.profiles.winch import WinchProfile


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
    from winchkit.schema.profiles.robot import RobotProfile

    declared = declared_profile(asked.source)
    if isinstance(declared, RobotProfile):
        refuse_options(asked.band, asked.winch)
        _tell_robot(runs, declared, asked, as_json, html, figures)
        return
    if asked.each:
        _tell_each(runs, declared, asked, as_json, html, figures)
        return
    with progress_bar() as progress:
        own = asked.runs(runs)
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


def _tell_each(
    runs: Sequence[str],
    declared: WinchProfile,
    asked: Asked,
    as_json: bool,
    html: str | None,
    figures: str | None,
) -> None:
    """Every winch of the runs by itself, and what their errors follow alike or not."""
    from winchkit.diagnosis.compare import compared
    from winchkit.fleet.diagnosis.anova import errors_of, shared_errors
    from winchkit.fleet.report.comparison import shared_errors_text
    from winchkit.report.pages.pages import comparison_figures, comparison_html
    from winchkit.report.reproducibility import Command
    from winchkit.report.text import compare_text

    found, errors = {}, {}
    title, catalogue = page_title(declared.name, runs), asked.catalogue
    with progress_bar() as progress:
        winches = read_each(runs)
        pages = pages_beside(html, list(winches)) if html else {}
        for index, (name, own) in enumerate(winches.items()):
            progress(f"winch {name}", index / len(winches))
            answer = compared(own, declared, catalogue, asked.band)
            found[name], errors[name] = answer.comparison, errors_of(answer)
            if html:
                options = replace(asked, winch=name).options
                page = comparison_html(answer, f"{title}, {name}", asked.profile, options=options)
                save_page(str(Path(html).with_name(pages[name])), page)
            if figures:
                source = Command(answer.regression.dataset, asked.profile).source
                save_figures(figures, comparison_figures(answer, source), name)
            del answer  # gigabytes after long runs
    shared = shared_errors(errors)
    if as_json:
        said = {name: one.to_json() for name, one in found.items()}
        outputs = {name: one.to_json() for name, one in shared.items()}
        echo_json({"schema": 1, "winches": said, "shared": {"outputs": outputs}})
    else:
        texts = {name: compare_text(one) for name, one in found.items()}
        echo_each(texts, shared_errors_text(found, shared))
    if html:
        from winchkit.fleet.report.comparison import shared_errors_html

        write_page(html, shared_errors_html(found, shared, title, pages))
    if figures:
        note(f"figures: {figures}")
    suggest_with("diagnose", asked, runs)


def _tell_robot(
    runs: Sequence[str],
    declared: RobotProfile,
    asked: Asked,
    as_json: bool,
    html: str | None,
    figures: str | None,
) -> None:
    """Poses with a robot's profile."""
    from winchkit.robot.diagnosis.compare import compared_robot

    with progress_bar() as progress:
        measured = read_all(runs)
        progress("comparing", None)
        answer = compared_robot(measured, declared, asked.catalogue)
    _tell(answer.comparison, as_json)
    if html:
        from winchkit.robot.report.diagnosis import robot_comparison_html

        title = page_title(declared.name, runs)
        write_page(html, robot_comparison_html(answer, title, asked.profile, options=asked.options))
    if figures:
        from winchkit.report.reproducibility import Command
        from winchkit.robot.report.diagnosis import robot_comparison_figures

        source = Command(answer.regression.dataset, asked.profile).source
        write_figures(figures, robot_comparison_figures(answer, source))
    suggest_with("diagnose", asked, runs)


def _tell(comparison: Comparison, as_json: bool) -> None:
    if as_json:
        echo_json(comparison.to_json())
        return
    from winchkit.report.text import compare_text

    click.echo(compare_text(comparison))
