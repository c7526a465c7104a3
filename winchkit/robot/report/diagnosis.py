"""Pages of a robot's diagnosis, comparison and added effect, self-contained and without script."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isfinite, nan, sqrt
from typing import Literal

import numpy as np

from winchkit.arrays import Array
from winchkit.profile_edit.naming import extended_name
from winchkit.quantity_text import scale_for
from winchkit.report.figures.axes import AxisLabel, reading
from winchkit.report.figures.figure import Figure, FigureAxis, FigureSeries, Panel
from winchkit.report.figures.ladder import error_ladder, present
from winchkit.report.figures.unexplained import unexplained_figures
from winchkit.report.html.markup import Markup, element, table
from winchkit.report.html.page import figure_block, page
from winchkit.report.pages.addition import addition_sections
from winchkit.report.pages.comparison import comparison_sections
from winchkit.report.pages.diagnosis import sections
from winchkit.report.pages.parts import output_card
from winchkit.report.reproducibility import CommandLine
from winchkit.report.tables import bar
from winchkit.report.words.headline import size_texts, worst_outputs
from winchkit.report.words.sentence import capital, where_text
from winchkit.report.words.vocabulary import OUTPUT_NAMES, VARIABLE_NAMES
from winchkit.robot.diagnosis.add import FittedRobotAddition
from winchkit.robot.diagnosis.attribution import AXES, on_cables
from winchkit.robot.diagnosis.compare import RobotCompared
from winchkit.robot.diagnosis.diagnose import RobotAnswer
from winchkit.robot.diagnosis.errors import UNITS, Errors
from winchkit.robot.diagnosis.regression import PoseRegression
from winchkit.robot.report.pose_traces import NUMBER, PoseErrorTrace, traces

_SPREAD = 0.25
"""Of the distance between two places: points of equal value are drawn beside each other."""
_CHANGED = 1.02
"""Ratio of the errors (rms) from which an output counts as changed by the added effects."""
_FEW_POSES = 400
"""Poses up to which a point is large."""


def pose_figures(
    regression: PoseRegression,
    before: Errors,
    after: Errors | None,
    noise: Mapping[str, float | None],
    *,
    order: Sequence[str] = (),
    changed: str = "with the effect",
    source: str = "",
) -> dict[str, Figure]:
    """Errors of every output over their main variable, in the given order.

    ``after`` is None where nothing was changed.
    """
    drawn = {trace.over.output: trace for trace in traces(regression, before, after)}
    ordered = [name for name in dict.fromkeys((*order, *drawn)) if name in drawn]
    return {
        name: replace(_figure(drawn[name], noise.get(name), changed), source=source)
        for name in ordered
    }


def _cards(
    regression: PoseRegression,
    figures: Mapping[str, Figure],
    before: Errors,
    after: Errors | None,
    sizes: Mapping[str, str],
) -> list[Markup]:
    """A card per output: its figure, and its error by line or axis."""
    cards = []
    for number, (name, figure) in enumerate(figures.items()):
        lines = list(AXES) if name == "platform_position" else list(regression.dataset.names)
        then = None if after is None else on_cables(regression, {name: after[name]})[name]
        each = _each_line(name, lines, on_cables(regression, {name: before[name]})[name], then)
        pair = element("div", figure_block(figure), element("div", each), class_="pair")
        cards.append(output_card(name, [pair], sizes, opened=number == 0))
    return cards


def _figure(trace: PoseErrorTrace, noise: float | None, changed: str) -> Figure:
    """Points of every pose, means as lines, the noise as a band."""
    how, unit = reading(trace.over.variable), UNITS[trace.over.output]
    scale = scale_for(float(np.abs(trace.before).max(initial=0.0)), unit)
    if noise is not None and trace.over.output == "platform_position":
        noise /= sqrt(len(AXES))  # Noise of one axis from that of the distance.
    states = [("today", "present model", trace.before)]
    if trace.after is not None and _differ(trace):
        states.append(("with", changed, trace.after))
    x = _beside(trace, np.asarray(how.shown(trace.x)))
    series = []
    for tone, name, values in states:
        mark: Literal["dots", "points"] = "dots" if len(x) > _FEW_POSES else "points"
        series.append(FigureSeries(name, tone, x, values / scale.worth, mark))
    for tone, name, values in states:
        at, mean = trace.means(values)
        if trace.over.variable != "winch":
            shown = np.asarray(how.shown(at))
            series.append(FigureSeries(f"mean, {name}", tone, shown, mean / scale.worth, "mean"))
    output = OUTPUT_NAMES.get(trace.over.output, trace.over.output)
    over = VARIABLE_NAMES.get(trace.over.variable, trace.over.variable)
    line = "" if trace.line is None else f", {_line_word(trace)} {trace.line}"
    return Figure(
        f"error-{trace.over.output}",
        f"{capital(output)} error over {over}{line}",
        _caption(trace, noise),
        _axis(trace, how),
        (
            Panel(
                FigureAxis("measured less predicted", scale.label, zero=True),
                tuple(series),
                None if noise is None or not isfinite(noise) else noise / scale.worth,
            ),
        ),
    )


def _line_word(trace: PoseErrorTrace) -> str:
    return "along" if trace.over.output == "platform_position" else "line"


def _differ(trace: PoseErrorTrace) -> bool:
    """Whether the added effects changed this output."""
    assert trace.after is not None
    sizes = [float(np.sqrt(np.mean(values**2))) for values in (trace.before, trace.after)]
    return max(sizes) > _CHANGED * min(sizes)


def _caption(trace: PoseErrorTrace, noise: float | None) -> str:
    over = trace.over
    if over.variable == NUMBER:
        name = OUTPUT_NAMES.get(over.output, over.output)
        text = f"{name}; no measured variable explains its error"
    else:
        text = where_text(over)
    if trace.line is not None and over.line is None:
        where = "along" if over.output == "platform_position" else "of line"
        text += f", drawn {where} {trace.line}, with the largest share"
    band = "" if noise is None else " The band is the noise, ± its rms."
    return f"{capital(text)}. Points are poses, lines their means.{band}"


def _axis(trace: PoseErrorTrace, how: AxisLabel) -> FigureAxis:
    if trace.over.variable == "winch":
        last = float(trace.x.max())
        names = tuple((float(n), str(n)) for n in range(1, int(last) + 1))
        return FigureAxis(
            "line, in the order of the file", limits=(0.4, last + 0.6), categories=names
        )
    return how.axis()


def _beside(trace: PoseErrorTrace, x: Array) -> Array:
    """Positions of the points; those of one line are side by side."""
    if trace.over.variable != "winch":
        return x
    out = x.copy()
    for value in np.unique(x):
        alike = x == value
        out[alike] += np.linspace(-_SPREAD, _SPREAD, int(np.count_nonzero(alike)))
    return out


def _each_line(name: str, lines: Sequence[str], before: Array, after: Array | None) -> Markup:
    """Bars of the error of every line, or axis, before and after."""
    states = [("before", before)] + ([] if after is None else [("after", after)])
    sizes = {tone: [_rms(values[:, k]) for k in range(len(lines))] for tone, values in states}
    every = [size for own in sizes.values() for size in own if isfinite(size)]
    longest = max(every, default=0.0)
    scale = scale_for(longest, UNITS[name])
    tones = {"before": "today", "after": "with"}
    rows = [
        [line, *(bar(own[k], 1.05 * longest, None, scale, tones[t]) for t, own in sizes.items())]
        for k, line in enumerate(lines)
    ]
    kind = "axis" if name == "platform_position" else "line"
    head = [kind, *(["today", "with it"] if after is not None else ["error"])]
    least = (
        " as the least cable forces that balance the residual wrench" if name == "tension" else ""
    )
    return element("div", table(f"Error, rms, by {kind}{least}.", head, rows), class_="bars")


def _rms(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else nan


def report_html(
    answer: RobotAnswer, title: str, profile: str = "", *, options: Sequence[str] = ()
) -> str:
    """The page of a robot's diagnosis; ``profile`` and ``options`` as the user gave them."""
    selection, diagnosis = answer.selection, answer.diagnosis
    command = CommandLine(selection.preparation.dataset, profile, options)
    drawn = _report_figures(answer, command.source)
    before, after = selection.errors
    fitted = after if diagnosis.steps else None
    regression = selection.final.regression
    cards = _cards(regression, drawn, before, fitted, size_texts(diagnosis.outputs))
    patterns = unexplained_figures(answer, command.source)
    ladder = _report_ladder(answer, command.source)
    content = sections(
        answer, cards, (), None, command, title=title, unexplained=patterns, ladder=ladder
    )
    return page(title, [*present(ladder), *drawn.values(), *patterns], content, headed=False)


def report_figures(answer: RobotAnswer, source: str = "") -> list[Figure]:
    """The figures of the page of a robot's diagnosis."""
    drawn = _report_figures(answer, source).values()
    ladder = _report_ladder(answer, source)
    return [*present(ladder), *drawn, *unexplained_figures(answer, source)]


def _report_ladder(answer: RobotAnswer, source: str) -> Figure | None:
    diagnosis = answer.diagnosis
    return error_ladder(
        diagnosis.outputs,
        extended=bool(diagnosis.steps),
        changed=_changed(answer),
        source=source,
    )


def _changed(answer: RobotAnswer) -> str:
    """Name of the changed model."""
    steps = answer.diagnosis.steps
    if steps and steps[0].whole:
        return "calibrated"
    return f"with {steps[0].effects[0]}" if len(steps) == 1 else f"with {len(steps)} effects"


def _report_figures(answer: RobotAnswer, source: str) -> dict[str, Figure]:
    diagnosis, selection = answer.diagnosis, answer.selection
    before, after = selection.errors
    noise = {name: output.noise_rms for name, output in diagnosis.outputs.items()}
    order = worst_outputs(diagnosis.outputs)
    fitted = after if diagnosis.steps else None
    return pose_figures(
        selection.final.regression,
        before,
        fitted,
        noise,
        order=order,
        changed=_changed(answer),
        source=source,
    )


def comparison_html(
    compared: RobotCompared, title: str, profile: str = "", *, options: Sequence[str] = ()
) -> str:
    """The page of a robot's comparison."""
    comparison = compared.comparison
    command = CommandLine(compared.regression.dataset, profile, options)
    drawn = _comparison_figures(compared, command.source)
    sizes = size_texts(comparison.outputs)
    ladder = error_ladder(comparison.outputs, source=command.source)
    cards = _cards(compared.regression, drawn, compared.errors, None, sizes)
    content = comparison_sections(
        comparison, compared.followed, cards, command, title=title, ladder=ladder
    )
    return page(title, [*present(ladder), *drawn.values()], content, headed=False)


def comparison_figures(compared: RobotCompared, source: str = "") -> list[Figure]:
    """The figures of the page of a robot's comparison."""
    ladder = error_ladder(compared.comparison.outputs, source=source)
    return [*present(ladder), *_comparison_figures(compared, source).values()]


def _comparison_figures(compared: RobotCompared, source: str) -> dict[str, Figure]:
    outputs = compared.comparison.outputs
    noise = {name: error.noise_rms for name, error in outputs.items()}
    order = worst_outputs(outputs)
    return pose_figures(
        compared.regression, compared.errors, None, noise, order=order, source=source
    )


def addition_html(
    fitted: FittedRobotAddition,
    title: str,
    profile: str = "",
    better: str = "",
    *,
    options: Sequence[str] = (),
) -> str:
    """The page of an effect added to a robot; ``better`` is the profile that was written."""
    command = CommandLine(fitted.regression.dataset, profile, options)
    drawn = _addition_figures(fitted, command.source)
    sizes = size_texts(fitted.addition.outputs)
    cards = _cards(fitted.regression, drawn, *fitted.errors, sizes)
    better = better or extended_name(command.profile, fitted.addition.added[0].effect.id)
    ladder = _addition_ladder(fitted, command.source)
    content = addition_sections(fitted.addition, cards, command, better, title=title, ladder=ladder)
    return page(title, [*present(ladder), *drawn.values()], content, headed=False)


def addition_figures(fitted: FittedRobotAddition, source: str = "") -> list[Figure]:
    """The figures of the page of an effect added to a robot."""
    ladder = _addition_ladder(fitted, source)
    return [*present(ladder), *_addition_figures(fitted, source).values()]


def _addition_ladder(fitted: FittedRobotAddition, source: str) -> Figure | None:
    changed = f"with {fitted.addition.added[0].label}"
    return error_ladder(fitted.addition.outputs, extended=True, changed=changed, source=source)


def _addition_figures(fitted: FittedRobotAddition, source: str) -> dict[str, Figure]:
    outputs = fitted.addition.outputs
    noise = {name: output.noise_rms for name, output in outputs.items()}
    before, after = fitted.errors
    changed = f"with {fitted.addition.added[0].label}"
    order = worst_outputs(outputs)
    return pose_figures(
        fitted.regression, before, after, noise, order=order, changed=changed, source=source
    )
