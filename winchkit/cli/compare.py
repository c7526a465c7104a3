"""``winchkit compare``: how far a profile is from measured runs, and what the error follows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from winchkit.cli.html_option import given_options, html_option, page_title, write_page
from winchkit.cli.output import echo_json
from winchkit.cli.runs_option import catalogue_of, model_options, read_runs

if TYPE_CHECKING:
    from winchkit.diagnosis.result import Comparison

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
    """Compare runs with a profile at its file values; only the length offset is fitted."""
    from winchkit.catalog import find
    from winchkit.cli.robot_model import read_poses_of, read_profile, refuse_options
    from winchkit.diagnosis.compare import compared
    from winchkit.schema.robot import RobotProfile

    declared = read_profile(find("profiles", profile))
    if isinstance(declared, RobotProfile):
        from winchkit.diagnosis.robot.compare import compare_robot

        refuse_options(band, html, winch)
        poses = read_poses_of(runs)
        _tell(compare_robot(poses, declared, catalogue_of(effect_files)), as_json)
        return
    answer = compared(read_runs(runs, winch), declared, catalogue_of(effect_files), band)
    _tell(answer.comparison, as_json)
    if html:
        from winchkit.diagnosis.report.page import comparison_html

        title = page_title(declared.name, runs)
        options = given_options(effect_files, winch, band)
        write_page(html, comparison_html(answer, title, profile, options=options))


def _tell(comparison: Comparison, as_json: bool) -> None:
    if as_json:
        echo_json(comparison.to_json())
        return
    from winchkit.diagnosis.report.text import compare_text

    click.echo(compare_text(comparison))
