"""``winchkit diagnose``: which physical effect the profile lacks, or that it lacks none."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from winchkit.cli.html_option import given_options, html_option, page_title, write_page
from winchkit.cli.output import echo_json
from winchkit.cli.runs_option import catalogue_of, model_options, read_runs

if TYPE_CHECKING:
    from winchkit.diagnosis.diagnose import Answer

__all__ = ["command"]


@click.command()
@click.argument("runs", nargs=-1, required=True, metavar="RUN...")
@model_options
@html_option
def command(
    runs: Sequence[str],
    profile: str,
    effect_files: Sequence[str],
    winch: str | None,
    band: float | None,
    as_json: bool,
    html: str | None,
) -> None:
    """Name the physical effect that the model lacks, with its size and what it would buy.

    Two runs of one programme and load are the measure of the noise: record everything twice.
    """
    from winchkit.catalog import find
    from winchkit.diagnosis.diagnose import diagnose
    from winchkit.schema.read import read_winch

    declared = read_winch(find("profiles", profile))
    answer = diagnose(read_runs(runs, winch), declared, catalogue_of(effect_files), band)
    _tell(answer, as_json)
    if html:
        from winchkit.diagnosis.report.page import report_html

        title = page_title(declared.name, runs)
        options = given_options(effect_files, winch, band)
        write_page(html, report_html(answer, title, profile=profile, options=options))


def _tell(answer: Answer, as_json: bool) -> None:
    if as_json:
        echo_json(answer.diagnosis.to_json())
        return
    from winchkit.diagnosis.report.text import report_text

    click.echo(report_text(answer))
