"""``winchkit diagnose``: which physical effect the profile lacks, or that it lacks none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from winchkit.cli.html_option import given_options, html_option, page_title, write_page
from winchkit.cli.output import echo_json
from winchkit.cli.progress import progress_bar
from winchkit.cli.runs_option import ALL, catalogue_of, model_options, read_each, read_runs
from winchkit.errors import UsageError

if TYPE_CHECKING:
    from winchkit.diagnosis.diagnose import Answer
    from winchkit.effects.catalogue import Catalogue
    from winchkit.schema.robot import RobotProfile
    from winchkit.schema.winch import WinchProfile

__all__ = ["command"]


@click.command()
@click.argument("runs", nargs=-1, required=True, metavar="RUN...")
@model_options
@click.option("--every-sample", is_flag=True, help="Do not thin long runs out.")
@html_option
def command(
    runs: Sequence[str],
    profile: str,
    effect_files: Sequence[str],
    winch: str | None,
    band: float | None,
    as_json: bool,
    every_sample: bool,
    html: str | None,
) -> None:
    """Name the physical effect that the model lacks, with its size and what it would buy.

    Two runs of one programme and load are the measure of the noise: record everything twice.
    Long runs are thinned out as far as their signals allow; --winch all takes each by itself.
    """
    from winchkit.catalog import find
    from winchkit.cli.robot_model import read_profile, refuse_options
    from winchkit.diagnosis.diagnose import diagnose
    from winchkit.schema.robot import RobotProfile

    if html and winch == ALL:
        raise UsageError("--html is a page of one winch; name it with --winch")
    declared, catalogue = read_profile(find("profiles", profile)), catalogue_of(effect_files)
    if isinstance(declared, RobotProfile):
        refuse_options(band, html, winch)
        _tell_robot(runs, declared, catalogue, as_json)
        return
    how = How(catalogue, band, not every_sample)
    if winch == ALL:
        _tell_each(runs, declared, how, as_json)
        return
    with progress_bar() as told:
        own = read_runs(runs, winch)
        answer = diagnose(own, declared, catalogue, band, thin=how.thin, told=told)
    (echo_json if as_json else click.echo)(_said(answer, as_json))
    if html:
        from winchkit.diagnosis.report.page import report_html

        title, options = page_title(declared.name, runs), given_options(effect_files, winch, band)
        write_page(html, report_html(answer, title, profile=profile, options=options))


@dataclass(frozen=True)
class How:
    """How runs are diagnosed."""

    catalogue: Catalogue
    band: float | None
    thin: bool


def _tell_each(runs: Sequence[str], declared: WinchProfile, how: How, as_json: bool) -> None:
    """What every winch of the runs lacks, each by itself."""
    from winchkit.diagnosis.each import diagnose_each

    with progress_bar() as told:
        each = diagnose_each(
            read_each(runs), declared, how.catalogue, how.band, thin=how.thin, told=told
        )
        found = {name: _said(answer, as_json) for name, answer in each}
    if as_json:
        echo_json({"schema": 1, "winches": found})
        return
    for name, text in found.items():
        click.echo(f"winch {name}")
        click.echo(text)


def _tell_robot(
    runs: Sequence[str], declared: RobotProfile, catalogue: Catalogue, as_json: bool
) -> None:
    """What a robot's model lacks, from poses."""
    from winchkit.cli.robot_model import read_poses_of
    from winchkit.diagnosis.report.sentence import sentence
    from winchkit.diagnosis.report.text import report_text
    from winchkit.diagnosis.robot.diagnose import diagnose_robot

    answer = diagnose_robot(read_poses_of(runs), declared, catalogue)
    if as_json:
        echo_json({**answer.diagnosis.to_json(), "sentence": sentence(answer.diagnosis)})
    else:
        click.echo(report_text(answer))


def _said(answer: Answer, as_json: bool) -> Any:
    """An answer as JSON data or as text: what is printed, without all that is behind it."""
    if as_json:
        from winchkit.diagnosis.report.as_json import report_json

        return report_json(answer)
    from winchkit.diagnosis.report.text import report_text

    return report_text(answer)
