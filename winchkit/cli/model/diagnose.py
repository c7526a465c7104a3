"""``winchkit diagnose``: which physical effect the profile lacks, or that it lacks none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from winchkit import wings
from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.messages import is_verbose, note, suggest_next
from winchkit.cli.core.output import echo_json, is_json, json_flag
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

if TYPE_CHECKING:
    from winchkit.diagnosis.diagnose import Answer, WinchAnswer
    from winchkit.diagnosis.results import Diagnosis, Step
    from winchkit.report.figures.figure import Figure
    from winchkit.schema.profiles.robot import RobotProfile
    from winchkit.schema.profiles.winch import WinchProfile


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit diagnose demo-*.csv -p bench-spiral",
        "winchkit diagnose demo-*.csv -p better.toml --html report.html",
    ),
)
@runs_argument
@model_options
@click.option("--every-sample", is_flag=True, help="Do not decimate long runs.")
@click.option(
    "--as-recorded", is_flag=True, help="Look for effects although a sign or unit looks wrong."
)
@click.option("--fit-report", is_flag=True, help="Print the report of the fit too.")
@json_flag("Print the answer as JSON.")
@html_option
@figures_option
def command(
    *,
    runs: Sequence[str],
    asked: Asked,
    every_sample: bool,
    as_recorded: bool,
    fit_report: bool,
    html: str | None,
    figures: str | None,
) -> None:
    """Name the physical effect that the model lacks, its size, and the error that it removes.

    The noise is estimated from two runs of one programme and load: record each motion twice.
    Ctrl-C prints the errors and the candidates so far, without a verdict.
    --verbose adds how the answer was reached: contributions, scores, detectable effects.
    Long runs are decimated as far as their signals allow; --winch all diagnoses each by
    itself and reports what they have in common.
    """
    from winchkit.schema.profiles.winch import WinchProfile

    declared = declared_profile(asked.source)
    how = {"decimate": not every_sample, "as_recorded": as_recorded}
    refuse_options(declared, asked.band, asked.winch)
    if asked.each and isinstance(declared, WinchProfile):
        by_winch = wings.part("fleet", "diagnose_command")
        by_winch(runs, declared, asked, how, html, figures)
    else:
        _tell_one(runs, declared, asked, how, html, figures)


def _tell_one(
    runs: Sequence[str],
    declared: WinchProfile | RobotProfile,
    asked: Asked,
    how: Mapping[str, bool],
    html: str | None,
    figures: str | None,
) -> None:
    """Diagnosis of one winch or robot, with a page where one is requested."""
    from winchkit.diagnosis.diagnose import diagnose

    known: list[WinchAnswer] = []
    try:
        with progress_bar() as progress:
            own, catalogue = asked.runs(runs, declared), asked.catalogue
            answer = diagnose(
                own,
                declared,
                catalogue,
                asked.band,
                **how,
                progress=progress,
                interrupted=known.append,
            )
    except KeyboardInterrupt:
        for each in known:  # The bar has ended: nothing is printed into its line.
            # Errors and candidates so far, no verdict.
            (echo_json if is_json() else click.echo)(
                each.diagnosis.to_json() if is_json() else said(each)
            )
        raise
    (echo_json if is_json() else click.echo)(said(answer))
    if html:
        write_page(html, answer_page(answer, page_title(declared.name, runs), asked))
    if figures:
        write_figures(figures, answer_figures(answer, asked))
    _suggest(answer.diagnosis, runs, asked, declared)


def answer_figures(answer: Answer, asked: Asked) -> Sequence[Figure]:
    """Figures of the page of an answer."""
    from winchkit.report.pages.pages import report_figures
    from winchkit.report.reproducibility import CommandLine

    return report_figures(
        answer, CommandLine(answer.engine.regression.dataset, asked.profile).source
    )


def _suggest(
    diagnosis: Diagnosis,
    runs: Sequence[str],
    asked: Asked,
    declared: WinchProfile | RobotProfile,
) -> None:
    """Next command: calibrate a robot, add the first effect, plan runs or write an effect."""
    if diagnosis.interrupted or diagnosis.verdict == "undecided":
        return
    if column := _mending(diagnosis, asked.predicted):
        suggest_next("import", runs, "--column", column, "-o", "corrected")
        return
    from winchkit.report.words.sentence import unrelated_outputs
    from winchkit.report.words.steps import needs_calibration, reported

    if unrelated_outputs(diagnosis):
        return
    from winchkit.profile_edit.naming import extended_name
    from winchkit.schema.profiles.axis import AxisProfile

    told = reported(diagnosis).steps
    first = next(iter(told), None)
    words = ("-p", asked.profile, *asked.options)
    if any(map(needs_calibration, told)):
        file = extended_name(asked.profile, "calibrated")
        suggest_next("calibrate", asked.profile, runs, "-o", file)
    elif diagnosis.verdict == "unknown" and diagnosis.data == "runs":
        suggest_next("effects", "new", "own.py", "--fit", runs, *words)
    elif first is not None and (effect := _added(first)):
        suggest_next(
            "add", effect, "--fit", runs, *words, "-o", extended_name(asked.profile, effect)
        )
    elif not isinstance(declared, AxisProfile):
        suggest_with("plan", asked, runs)


def _added(step: Step) -> str:
    """Effect that a step adds, with an open law the curve over its variable; empty for a set."""
    from winchkit.effects.empirical import EMPIRICAL, empirical_id, shown_id

    outputs, variable = {place.output for place in step.place}, step.curve.replace(" ", "_")
    for output in outputs if len(outputs) == 1 else ():
        if empirical_id(output, variable) in EMPIRICAL:
            return shown_id(output, variable)
    return step.effects[0] if len(step.effects) == 1 else ""


def _mending(diagnosis: Diagnosis, predicted: str | None) -> str:
    """Column of an import that corrects the first wrong channel, where nothing was searched; of a
    prediction by another model, ``OUTPUT=COLUMN``, that of the model: either may be wrong."""
    from winchkit.diagnosis.data.sanity import ALARMING
    from winchkit.diagnosis.data.sign_and_scale import mending_column
    from winchkit.runs.predicted import OF_OUTPUT

    wrong = next((f for f in diagnosis.sanity if f.code in ALARMING), None)
    if wrong is None or diagnosis.steps or diagnosis.candidates:
        return ""
    output, _, column = (predicted or "").partition("=")
    if not column or wrong.channel != output:
        return mending_column(wrong)
    note(f"the {output.replace('_', ' ')} that is measured or '{column}' is wrong; of the latter:")
    own = OF_OUTPUT[output]
    mended = mending_column(replace(wrong, channel=own, value=1 / wrong.value))
    return mended.replace(f"={own}", f"={column}").replace(f"=-{own}", f"=-{column}")


def answer_page(answer: Answer, title: str, asked: Asked) -> str:
    """An answer as a page, with the commands that repeat it."""
    from winchkit.report.pages.pages import report_html

    return report_html(answer, title, profile=asked.profile, options=asked.options)


def said(answer: Answer) -> Any:
    """An answer as JSON data or as text, without the data behind it."""
    if is_json():
        from winchkit.report.as_json import report_json

        return report_json(answer)
    from winchkit.report.text import report_text

    text = report_text(answer, verbose=is_verbose())
    # An option of the command, read here instead of being handed through every kind of answer.
    with_fit = click.get_current_context().params["fit_report"]
    return f"{text}\n\n{answer.fit_report()}" if with_fit else text
