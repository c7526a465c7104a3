"""Sections of the page of a diagnosis, in order of use."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isnan

from winchkit.diagnosis.diagnose import Answer
from winchkit.diagnosis.results import Diagnosis
from winchkit.profile_edit.naming import extended_name
from winchkit.quantity_text import percent
from winchkit.report import tables
from winchkit.report.as_json import report_json
from winchkit.report.detectability import effects_of, smallest_shown
from winchkit.report.figures.figure import Figure
from winchkit.report.figures.waterfall import falls_of, waterfall_of
from winchkit.report.html.markup import Markup, element, facts, folded, join, table
from winchkit.report.html.page import figure_block
from winchkit.report.pages.parts import bullets, code_block, compared_text, data, lead
from winchkit.report.reproducibility import CommandLine, repeat
from winchkit.report.words.sentence import (
    changes_text,
    error_text,
    headline,
    remaining_text,
    where_text,
)
from winchkit.report.words.steps import reported, reported_steps
from winchkit.report.words.vocabulary import VERDICT_NAMES, listed


def sections(
    answer: Answer,
    figures: Sequence[Markup],
    story: Sequence[str],
    truth: Mapping[str, object] | None,
    command: CommandLine,
    *,
    title: str = "",
    unexplained: Sequence[Figure] = (),
    open_laws: Sequence[Figure] = (),
    ratios: Figure | None = None,
) -> Markup:
    """Content of the page: summary and figures, and everything else to be opened."""
    diagnosis = answer.diagnosis
    effects = effects_of(answer)
    runs = diagnosis.data
    return join(
        [
            _verdict(answer, command, title, ratios),
            folded("story", "Procedure", _story(story)),
            element("div", *figures, id="residuals"),
            folded(
                "effects",
                "Effects: formula and source",
                _named(answer),
            ),
            folded(
                "waterfall",
                "Contribution of each effect",
                element("div", tables.waterfall(waterfall_of(answer), diagnosis), class_="bars")
                if diagnosis.steps
                else Markup(""),
            ),
            folded("open", "Open laws: the curve and the closest law", _open_laws(open_laws)),
            folded("unexplained", "Unexplained residual", _unexplained(answer, unexplained)),
            folded(
                "confusion",
                f"Effects that cannot be distinguished with these {runs}",
                tables.equivalence(diagnosis, effects),
            ),
            folded("next", "Next runs", _next(diagnosis)),
            folded("candidates", "Candidate effects", tables.candidates(answer)),
            folded(
                "fit", "Fit: statistics, values and their correlation", tables.fit_of(diagnosis)
            ),
            folded(
                "detectable",
                f"Effects that are detectable with these {runs}",
                tables.detectable(answer),
            ),
            folded("data", "Data", data(diagnosis)),
            folded("notes", "Notes", bullets(diagnosis.notes)),
            folded("truth", "Simulated effect", _truth(truth)),
            repeat(command, _commands(diagnosis, command), "diagnosis", report_json(answer)),
        ]
    )


def _verdict(answer: Answer, command: CommandLine, title: str, ratios: Figure | None) -> Markup:
    diagnosis = answer.diagnosis
    seen = smallest_shown(answer) if diagnosis.verdict == "adequate" else []
    shown = f"Detectable with these {diagnosis.data}, among others: {listed(seen)}." if seen else ""
    known = not diagnosis.interrupted
    rows = [
        ("Compared", compared_text(command.dataset, command.profile)),
        ("Missing", tables.steps(diagnosis, falls_of(answer))),
        ("Error", error_text(diagnosis)),
        ("Remains", remaining_text(diagnosis)),
        ("Detectable", shown),
        (
            "Cure" if reported_steps(diagnosis) else "Next",
            _cure(diagnosis, command) if known else "",
        ),
        ("Then", changes_text(diagnosis) if known else ""),
    ]
    return lead(
        title,
        VERDICT_NAMES[diagnosis.verdict],
        diagnosis.verdict,
        headline(diagnosis),
        rows,
        tables.figures(diagnosis),
        *([figure_block(ratios, 480)] if ratios else []),
    )


def _cure(diagnosis: Diagnosis, command: CommandLine) -> str:
    """The command that adds the first effect, or continues without one."""
    if diagnosis.verdict == "adequate":
        return "None is needed."
    continued = _commands(diagnosis, command)[2:]
    return code_block(continued[0]) if continued else ""


def _named(answer: Answer) -> Markup:
    effects = effects_of(answer)
    return tables.named(
        (effects.get(name), name, step.parameters.get(name, {}))
        for step in answer.diagnosis.steps
        if not step.whole
        for name in step.effects
    )


def _story(story: Sequence[str]) -> Markup:
    items = [element("li", line) for line in story]
    return element("ol", *items) if items else Markup("")


def _unexplained(answer: Answer, figures: Sequence[Figure]) -> Markup:
    diagnosis = answer.diagnosis
    if diagnosis.verdict == "adequate" or diagnosis.interrupted:
        return Markup("")
    share = percent(diagnosis.unexplained_share)
    left = element("p", f"{share} of the error above the noise remains.")
    places = bullets([where_text(where) for where in diagnosis.where])
    caption = "Its patterns; correlated variables explain the same part of the residual:"
    head = element("p", caption) if places else Markup("")
    drawn = [figure_block(one, 480) for one in figures]
    pair = element("div", *drawn, class_="pair maps") if drawn else Markup("")
    return join([left, head, places, pair, _offer(diagnosis)])


def _open_laws(figures: Sequence[Figure]) -> Markup:
    """Curves that explain more than the closest law of the catalogue, with that law."""
    blocks = [figure_block(one, 480) for one in figures]
    return element("div", *blocks, class_="pair maps") if blocks else Markup("")


def _offer(diagnosis: Diagnosis) -> Markup:
    """Commands that continue with an unexplained residual."""
    if not diagnosis.empirical or diagnosis.verdict == "explained":
        return Markup("")
    return element(
        "p",
        element("code", f"winchkit add {diagnosis.empirical[0]}"),
        " adds it as an empirical curve, and ",
        element("code", "winchkit effects new"),
        " creates an effect of your own from it; the full commands are below.",
    )


def _next(diagnosis: Diagnosis) -> Markup:
    if not diagnosis.next_runs:
        return Markup("")
    rows = [
        [" / ".join(r.separates) or "–", r.programme, "–" if isnan(r.power) else percent(r.power)]
        for r in diagnosis.next_runs
    ]
    caption = (
        "Runs that distinguish effects, and the power of the test; – where a change of the machine "
        "is needed in place of a motion."
    )
    return table(caption, ["effects", "run", "power"], rows, words=2)


def _truth(truth: Mapping[str, object] | None) -> Markup:
    if not truth:
        return Markup("")
    return facts((str(name), str(value)) for name, value in truth.items())


def _commands(diagnosis: Diagnosis, command: CommandLine) -> list[str]:
    """Commands that reproduce the result and continue from it."""
    profile = command.profile
    commands = [command.compare(profile), command.diagnose(profile)]
    for step in reported(diagnosis).steps:
        if step.refitted:
            continue
        better = extended_name(profile, "calibrated" if step.whole else step.effects[0])
        more = command.calibrate(profile, better)
        commands.append(more if step.whole else command.add(step.effects[0], profile, better))
        profile = better
    if diagnosis.empirical and diagnosis.verdict in {"partly", "unknown", "undecided"}:
        commands.append(command.add(diagnosis.empirical[0], profile, "with-curve.toml"))
        commands.append(command.begin_effect(profile, "my_effect.py"))
    return commands
