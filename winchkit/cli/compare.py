"""``winchkit compare``: how far a profile is from measured runs, and what the error follows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from winchkit.cli.html_option import html_option, page_title, write_page
from winchkit.cli.output import echo_json
from winchkit.cli.runs_option import Asked, json_option, model_options, read_all

if TYPE_CHECKING:
    from winchkit.diagnosis.result import Comparison

__all__ = ["command"]


@click.command()
@click.argument("runs", nargs=-1, required=True, metavar="RUN...")
@model_options
@json_option
@html_option
def command(runs: Sequence[str], asked: Asked, as_json: bool, html: str | None) -> None:
    """Compare runs with a profile at its file values; only the length offset is fitted."""
    from winchkit.cli.robot_model import read_profile, refuse_options
    from winchkit.diagnosis.compare import compared
    from winchkit.diagnosis.report.page import comparison_html
    from winchkit.schema.robot import RobotProfile

    declared = read_profile(asked.source)
    if isinstance(declared, RobotProfile):
        from winchkit.diagnosis.robot.compare import compare_robot

        refuse_options(asked.band, html, asked.winch)
        _tell(compare_robot(read_all(runs), declared, asked.catalogue), as_json)
        return
    answer = compared(asked.runs(runs), declared, asked.catalogue, asked.band)
    _tell(answer.comparison, as_json)
    if html:
        title = page_title(declared.name, runs)
        write_page(html, comparison_html(answer, title, asked.profile, options=asked.options))


def _tell(comparison: Comparison, as_json: bool) -> None:
    if as_json:
        echo_json(comparison.to_json())
        return
    from winchkit.diagnosis.report.text import compare_text

    click.echo(compare_text(comparison))
