"""The sections of a report's page, in the order in which a bench engineer reads."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from math import isnan
from platform import python_version

from winchkit.diagnosis.diagnose import Answer
from winchkit.diagnosis.problem import Problem
from winchkit.diagnosis.report import tables
from winchkit.diagnosis.report.embed import compact
from winchkit.diagnosis.report.markup import Markup, details, element, join, section, table
from winchkit.diagnosis.report.phrases import OUTPUT_NAMES, VERDICT_NAMES, listed
from winchkit.diagnosis.report.plots import OutputPlots, Plot
from winchkit.diagnosis.report.sentence import moved_outputs, sentence, where_text
from winchkit.diagnosis.report.shown import effects_of, smallest_shown
from winchkit.diagnosis.report.waterfall import waterfall_of
from winchkit.diagnosis.report.wording import percent, unbroken
from winchkit.diagnosis.result import Diagnosis

__all__ = ["sections"]

_TRACE = 0.005


def sections(
    answer: Answer,
    plots: Sequence[OutputPlots],
    story: Sequence[str],
    truth: Mapping[str, object] | None,
    profile: str,
) -> Markup:
    """Everything below the title."""
    diagnosis = answer.diagnosis
    effects = effects_of(answer)
    return join(
        [
            _verdict(answer),
            section("story", "What was done", _story(story)),
            section("residuals", "Where the model fails", *_drawings(diagnosis, plots)),
            section(
                "waterfall",
                "What each step buys",
                tables.waterfall(waterfall_of(answer), diagnosis),
            ),
            section("candidates", "What else was considered", tables.candidates(answer)),
            section(
                "confusion",
                "What these runs cannot tell apart",
                tables.confusion(diagnosis, effects),
            ),
            section("detectable", "What these runs could show", tables.detectable(answer)),
            section("unexplained", "What is left unexplained", _unexplained(diagnosis)),
            section("next", "What to run next", _next(diagnosis)),
            section("notes", "Notes", _list(diagnosis.notes)),
            section("truth", "What was hidden", _truth(truth)),
            section("repeat", "How to repeat this", *_repeat(answer, profile)),
        ]
    )


def _verdict(answer: Answer) -> Markup:
    diagnosis = answer.diagnosis
    inside = [
        element("h2", VERDICT_NAMES[diagnosis.verdict], id="verdict-heading", class_="chip"),
        element("p", unbroken(sentence(diagnosis)), class_="sentence"),
    ]
    if diagnosis.verdict == "adequate":
        seen = smallest_shown(answer)
        if seen:
            words = "These runs would have shown, among others, "
            inside.append(element("p", words, listed(seen), "."))
    inside += [tables.named(diagnosis, effects_of(answer)), tables.figures(diagnosis)]
    inside.append(element("p", _changes(diagnosis), class_="quiet"))
    return element(
        "section",
        *inside,
        id="verdict",
        class_=f"verdict {diagnosis.verdict}",
        aria_labelledby="verdict-heading",
    )


def _changes(diagnosis: Diagnosis) -> str:
    """What would change the verdict."""
    if diagnosis.verdict == "adequate":
        return (
            "What would change this: runs with other loads, strokes, speeds or temperatures in "
            "which the error rises above the noise."
        )
    if not diagnosis.steps:
        return (
            "No name is given, because with so much left it would be a guess. What would change "
            "this: an effect of your own that explains the place below, or a run that isolates it."
        )
    if any(len(step.effects) > 1 for step in diagnosis.steps):
        return "What would change this: a run in which the rivals below differ."
    return (
        "What would change this: a run with another load, stroke or speed that the fitted values "
        "do not predict down to the noise."
    )


def _story(story: Sequence[str]) -> Markup:
    items = [element("li", line) for line in story]
    return element("ol", *items) if items else Markup("")


def _list(lines: Sequence[str]) -> Markup:
    items = [element("li", line[:1].upper() + line[1:]) for line in lines]
    return element("ul", *items) if items else Markup("")


def _drawings(diagnosis: Diagnosis, plots: Sequence[OutputPlots]) -> list[Markup]:
    moved = moved_outputs(diagnosis) if diagnosis.steps else []
    ordered = sorted(plots, key=lambda p: moved.index(p.output) if p.output in moved else 99)
    out = []
    for own in ordered:
        name = OUTPUT_NAMES.get(own.output, own.output)
        title = element("h3", name[:1].upper() + name[1:])
        if own.over_variable is None:
            words = element("p", "It follows nothing that was measured.", class_="quiet")
            out.append(element("div", title, _figure(own.over_time), words, class_="output"))
            continue
        pair = element("div", _figure(own.over_time), _figure(own.over_variable), class_="pair")
        out.append(element("div", title, pair, class_="output"))
    return out


def _figure(plot: Plot) -> Markup:
    canvas = element("div", class_="plot", data_plot=plot.id, role="img", aria_label=plot.caption)
    return element("figure", canvas, element("figcaption", unbroken(plot.caption)))


def _unexplained(diagnosis: Diagnosis) -> Markup:
    if diagnosis.verdict == "explained" and diagnosis.unexplained_share >= _TRACE:
        left = percent(diagnosis.unexplained_share)
        trace = f"A trace of {left} of what stood above the noise is left, below the noise itself."
        return element("p", trace)
    if diagnosis.verdict not in {"partly", "unknown"}:
        return Markup("")
    left = f"{percent(diagnosis.unexplained_share)} of what stood above the noise is left."
    places = _list([where_text(where) for where in diagnosis.where])
    lead = "Where it shows; variables that move together show the same error more than once:"
    return join([element("p", left), element("p", lead) if places else Markup(""), places])


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


def _repeat(answer: Answer, profile: str) -> list[Markup]:
    problem, diagnosis = answer.inquiry.problem, answer.diagnosis
    profile = profile or problem.dataset.profile.name
    commands = "\n".join(_commands(problem, diagnosis, profile))
    versions = ", ".join(f"{name} {version(name)}" for name in ("winchkit", "numpy", "scipy"))
    return [
        _runs(problem),
        element(
            "p", "Profile: ", element("code", profile), f". {versions}, Python {python_version()}."
        ),
        element("pre", element("code", commands), tabindex="0"),
        details("The diagnosis as JSON", element("pre", compact(diagnosis.to_json(), indent=1))),
    ]


def _runs(problem: Problem) -> Markup:
    recordings = problem.dataset.recordings
    sets = {run: n for n, group in enumerate(problem.dataset.repeated, 1) for run in group.runs}
    rows = []
    for index, recording in enumerate(recordings):
        time = recording.signals.time
        left_out = sum(int((~valid).sum()) for valid in recording.valid.values())
        rows.append(
            [
                recording.name,
                recording.programme or "–",
                f"set {sets[index]}" if index in sets else "none",
                f"{len(time)}",
                f"{time[-1] - time[0]:.1f} s",
                f"{left_out}",
            ]
        )
    head = ["run", "programme", "repeats", "samples", "length", "left out"]
    return table("Runs used; runs of one set repeat each other.", head, rows, words=3)


def _commands(problem: Problem, diagnosis: Diagnosis, profile: str) -> list[str]:
    """What to type to get this again, and to go on from it."""
    runs = " ".join(shlex.quote(r.path or r.name) for r in problem.dataset.recordings)
    named = shlex.quote(profile)
    commands = [
        f"winchkit compare {runs} --profile {named}",
        f"winchkit diagnose {runs} --profile {named} --html report.html",
    ]
    for number, step in enumerate(diagnosis.steps, start=1):
        better = f"better-{number}.toml"
        effect = shlex.quote(step.effects[0])
        commands.append(f"winchkit add {effect} --profile {named} --fit {runs} -o {better}")
        named = better
    return commands
