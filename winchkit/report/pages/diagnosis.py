"""Sections of the page of a diagnosis, in order of use."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isnan

from winchkit.diagnosis.diagnose import Answer
from winchkit.diagnosis.results import Diagnosis
from winchkit.report import tables
from winchkit.report.as_json import report_json
from winchkit.report.detectability import effects_of, smallest_shown
from winchkit.report.figures.unexplained import unexplained_figures
from winchkit.report.figures.waterfall import waterfall_of
from winchkit.report.html.markup import Markup, element, join, section, table
from winchkit.report.pages.parts import bullets, data, lead
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
    """Content below the title."""
    diagnosis = answer.diagnosis
    effects = effects_of(answer)
    return join(
        [
            _verdict(answer),
            section("story", "Procedure", _story(story)),
            section("residuals", "Residuals", *figures),
            section(
                "waterfall",
                "Contribution of each effect",
                tables.waterfall(waterfall_of(answer), diagnosis),
            ),
            section("candidates", "Candidate effects", tables.candidates(answer)),
            section(
                "confusion",
                f"Effects that cannot be distinguished with these {diagnosis.data}",
                tables.equivalence(diagnosis, effects),
            ),
            section("correlations", "Correlation of fitted values", tables.correlations(diagnosis)),
            section(
                "detectable",
                f"Effects that are detectable with these {diagnosis.data}",
                tables.detectable(answer),
            ),
            section("unexplained", "Unexplained residual", _unexplained(answer)),
            section("next", "Next runs", _next(diagnosis)),
            section("data", "Data", data(diagnosis)),
            section("notes", "Notes", bullets(diagnosis.notes)),
            section("truth", "Simulated effect", _truth(truth)),
            repeat(command, _commands(diagnosis, command), "diagnosis", report_json(answer)),
        ]
    )


def _verdict(answer: Answer) -> Markup:
    diagnosis = answer.diagnosis
    seen = smallest_shown(answer) if diagnosis.verdict == "adequate" else []
    shown = element(
        "p", f"Detectable with these {diagnosis.data}, among others: ", listed(seen), "."
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
        return element(
            "p",
            f"{left} of the residual variance above the noise floor remains; it is below the noise "
            "floor itself.",
        )
    if diagnosis.verdict not in {"partly", "unknown"}:
        return Markup("")
    share = percent(diagnosis.unexplained_share)
    left = element("p", f"{share} of the residual variance above the noise floor remains.")
    places = bullets([where_text(where) for where in diagnosis.where])
    caption = "Its patterns; correlated variables explain the same part of the residual:"
    head = element("p", caption) if places else Markup("")
    return join([left, head, places, *unexplained_figures(answer), _offer(diagnosis)])


def _offer(diagnosis: Diagnosis) -> Markup:
    """Commands that continue with an unexplained residual."""
    if not diagnosis.empirical:
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
        [" / ".join(r.separates), r.programme, "–" if isnan(r.power) else percent(r.power)]
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
    pairs = [(element("dt", str(k)), element("dd", str(v))) for k, v in truth.items()]
    return element("dl", *(part for pair in pairs for part in pair), class_="facts")


def _commands(diagnosis: Diagnosis, command: Command) -> list[str]:
    """Commands that reproduce the result and continue from it."""
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
