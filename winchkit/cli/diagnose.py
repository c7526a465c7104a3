"""``winchkit diagnose``: which physical effect the profile lacks, or that it lacks none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

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
    Long runs are thinned out as far as their signals allow. --winch all takes every winch of the
    runs by itself, each against the same profile.
    """
    from winchkit.catalog import find
    from winchkit.cli.robot_model import read_profile, refuse_options
    from winchkit.diagnosis.diagnose import diagnose_each
    from winchkit.schema.robot import RobotProfile

    if html and winch == ALL:
        raise UsageError("--html is a page of one winch; name it with --winch")
    declared = read_profile(find("profiles", profile))
    if isinstance(declared, RobotProfile):
        refuse_options(band, html, winch)
        _tell_robot(runs, declared, catalogue_of(effect_files), as_json)
        return
    catalogue = catalogue_of(effect_files)
    with progress_bar() as told:
        of_winch = read_each(runs) if winch == ALL else {winch or "": read_runs(runs, winch)}
        answers = diagnose_each(
            of_winch, declared, catalogue, band, thin=not every_sample, told=told
        )
    _tell(answers, as_json, each=winch == ALL)
    if html:
        from winchkit.diagnosis.report.page import report_html

        (answer,) = answers.values()
        title = page_title(declared.name, runs)
        options = given_options(effect_files, winch, band)
        write_page(html, report_html(answer, title, profile=profile, options=options))


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


def _tell(answers: Mapping[str, Answer], as_json: bool, *, each: bool) -> None:
    if as_json:
        from winchkit.diagnosis.report.as_json import report_json

        found = {name: report_json(answer) for name, answer in answers.items()}
        echo_json({"schema": 1, "winches": found} if each else next(iter(found.values())))
        return
    from winchkit.diagnosis.report.text import report_text

    for name, answer in answers.items():
        if each:
            click.echo(f"winch {name}")
        click.echo(report_text(answer))
