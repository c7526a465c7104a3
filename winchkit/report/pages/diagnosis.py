"""The sections of a diagnosis' page, in the order in which a bench engineer reads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isnan

from winchkit.diagnosis.diagnose import Answer
from winchkit.diagnosis.results import Diagnosis
from winchkit.report import tables
from winchkit.report.as_json import report_json
from winchkit.report.detectability import effects_of, smallest_shown
from winchkit.report.figures.rest import rest_figures
from winchkit.report.figures.waterfall import waterfall_of
from winchkit.report.html.markup import Markup, element, join, section, table
from winchkit.report.pages.parts import bullets, lead
from winchkit.report.reproducibility import Command, repeat
from winchkit.report.words.numbers import percent
from winchkit.report.words.sentence import changes_text, sentence, where_text
from winchkit.report.words.vocabulary import VERDICT_NAMES, listed

__all__ = ["sections"]

_TRACE = 0.005


def sections(
    answer: Answer,
    figures: Sequence[Markup],
    story: Sequence[str],
    truth: Mapping[str, object] | None,
    command: Command,
) -> Markup:
    """Everything below the title."""
    diagnosis = answer.diagnosis
    effects = effects_of(answer)
    return join(
        [
            _verdict(answer),
            section("story", "What was done", _story(story)),
            section("residuals", "Where the model fails", *figures),
            section(
                "waterfall",
                "What each step buys",
                tables.waterfall(waterfall_of(answer), diagnosis),
            ),
            section("candidates", "What else was considered", tables.candidates(answer)),
            section(
                "confusion",
                f"What these {diagnosis.data} cannot tell apart",
                tables.equivalence(diagnosis, effects),
            ),
            section(
                "detectable",
                f"What these {diagnosis.data} could show",
                tables.detectable(answer),
            ),
            section("unexplained", "What is left unexplained", _unexplained(answer)),
            section("next", "What to run next", _next(diagnosis)),
            section("notes", "Notes", bullets(diagnosis.notes)),
            section("truth", "What was hidden", _truth(truth)),
            repeat(command, _commands(diagnosis, command), "diagnosis", report_json(answer)),
        ]
    )


def _verdict(answer: Answer) -> Markup:
    diagnosis = answer.diagnosis
    seen = smallest_shown(answer) if diagnosis.verdict == "adequate" else []
    shown = element(
        "p", f"These {diagnosis.data} would have shown, among others, ", listed(seen), "."
    )
    return lead(
        VERDICT_NAMES[diagnosis.verdict],
        diagnosis.verdict,
        [sentence(diagnosis)],
        *([shown] if seen else []),
        _named(answer),
        tables.figures(diagnosis),
        element("p", changes_text(diagnosis), class_="quiet"),
    )


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


def _unexplained(answer: Answer) -> Markup:
    diagnosis = answer.diagnosis
    if diagnosis.verdict == "explained" and diagnosis.unexplained_share >= _TRACE:
        left = percent(diagnosis.unexplained_share)
        trace = f"A trace of {left} of what stood above the noise is left, below the noise itself."
        return element("p", trace)
    if diagnosis.verdict not in {"partly", "unknown"}:
        return Markup("")
    left = f"{percent(diagnosis.unexplained_share)} of what stood above the noise is left."
    places = bullets([where_text(where) for where in diagnosis.where])
    lead = "Where it shows; variables that move together show the same error more than once:"
    lives = element("p", lead) if places else Markup("")
    return join([element("p", left), lives, places, *rest_figures(answer), _offer(diagnosis)])


def _offer(diagnosis: Diagnosis) -> Markup:
    """How to take up a rest that is not understood."""
    if not diagnosis.empirical:
        return Markup("")
    return element(
        "p",
        "Until it is understood, ",
        element("code", f"winchkit add {diagnosis.empirical[0]}"),
        " adds it as a curve that is marked as not understood, and ",
        element("code", "winchkit effects new"),
        " begins an effect of your own from it; both stand below in full.",
    )


def _next(diagnosis: Diagnosis) -> Markup:
    if not diagnosis.next_runs:
        return Markup("")
    rows = [
        [" / ".join(r.separates), r.programme, "–" if isnan(r.power) else percent(r.power)]
        for r in diagnosis.next_runs
    ]
    caption = (
        "What would tell effects apart, and the chance that it does; – where no motion does, "
        "only the change that is named."
    )
    return table(caption, ["effects", "what to run", "power"], rows, words=2)


def _truth(truth: Mapping[str, object] | None) -> Markup:
    if not truth:
        return Markup("")
    pairs = [(element("dt", str(k)), element("dd", str(v))) for k, v in truth.items()]
    return element("dl", *(part for pair in pairs for part in pair), class_="facts")


def _commands(diagnosis: Diagnosis, command: Command) -> list[str]:
    """What to type to get this again, and to go on from it."""
    profile = command.profile
    commands = [command.compare(profile), command.diagnose(profile)]
    for number, step in enumerate(diagnosis.steps, start=1):
        better = f"better-{number}.toml"
        more = command.calibrate(profile, better)
        commands.append(more if step.whole else command.add(step.effects[0], profile, better))
        profile = better
    if diagnosis.empirical and diagnosis.verdict in {"partly", "unknown"}:
        commands.append(command.add(diagnosis.empirical[0], profile, "with-curve.toml"))
        commands.append(command.begin_effect(profile, "my_effect.py"))
    return commands
