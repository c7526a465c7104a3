"""Pages of a robot's diagnosis, comparison and added effect, self-contained and without script."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import isfinite, sqrt
from typing import Literal

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.results import OutputError, OutputFit
from winchkit.profile_edit.naming import extended_name
from winchkit.quantity_text import scale_for
from winchkit.report.figures.axes import AxisLabel, reading
from winchkit.report.figures.error_ratios import error_ratios, present
from winchkit.report.figures.figure import Figure, FigureAxis, FigureSeries, Panel
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
from winchkit.robot.calibration.prediction import rms
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


@dataclass(frozen=True)
class _PoseReport:
    """Errors of the poses by a model and by a changed one, as a page shows them."""

    regression: PoseRegression
    outputs: Mapping[str, OutputFit] | Mapping[str, OutputError]
    before: Errors
    after: Errors | None
    """None where nothing was changed."""
    changed: str
    """Name of the changed model."""
    source: str

    @cached_property
    def drawn(self) -> dict[str, Figure]:
        """Errors of every output over their main variable, the worst first."""
        found = {t.over.output: t for t in traces(self.regression, self.before, self.after)}
        ordered = dict.fromkeys((*worst_outputs(self.outputs), *found))
        noise = {name: output.noise_rms for name, output in self.outputs.items()}
        return {
            name: replace(_figure(found[name], noise.get(name), self.changed), source=self.source)
            for name in ordered
            if name in found
        }

    @cached_property
    def ratios(self) -> Figure | None:
        """Errors over the noise; None where no noise is known."""
        return error_ratios(
            self.outputs,
            extended=self.after is not None,
            changed=self.changed,
            source=self.source,
        )

    @property
    def figures(self) -> list[Figure]:
        """The figure of the ratios, where there is one, then the errors."""
        return [*present(self.ratios), *self.drawn.values()]

    def cards(self) -> list[Markup]:
        """A card per output: its figure, and its error by line or axis."""
        cards, sizes = [], size_texts(self.outputs)
        for number, (name, figure) in enumerate(self.drawn.items()):
            before = self._on_cables(name, self.before)
            after = None if self.after is None else self._on_cables(name, self.after)
            each = _each_line(name, self._lines(name), before, after)
            pair = element("div", figure_block(figure), element("div", each), class_="pair")
            cards.append(output_card(name, [pair], sizes, opened=number == 0))
        return cards

    def _on_cables(self, output: str, errors: Errors) -> Array:
        return on_cables(self.regression, {output: errors[output]})[output]

    def _lines(self, output: str) -> Sequence[str]:
        return AXES if output == "platform_position" else self.regression.dataset.names


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
    sizes = {tone: [rms(values[:, k]) for k in range(len(lines))] for tone, values in states}
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


def _of_answer(answer: RobotAnswer, source: str) -> _PoseReport:
    selection, steps = answer.selection, answer.diagnosis.steps
    before, after = selection.errors
    changed = f"with {steps[0].effects[0]}" if len(steps) == 1 else f"with {len(steps)} effects"
    if steps and steps[0].whole:
        changed = "calibrated"
    return _PoseReport(
        selection.final.regression,
        answer.diagnosis.outputs,
        before,
        after if steps else None,
        changed,
        source,
    )


def report_html(
    answer: RobotAnswer, title: str, profile: str = "", *, options: Sequence[str] = ()
) -> str:
    """The page of a robot's diagnosis; ``profile`` and ``options`` as the user gave them."""
    command = CommandLine(answer.selection.preparation.dataset, profile, options)
    shown = _of_answer(answer, command.source)
    patterns = unexplained_figures(answer, command.source)
    content = sections(
        answer,
        shown.cards(),
        (),
        None,
        command,
        title=title,
        unexplained=patterns,
        ratios=shown.ratios,
    )
    return page(title, [*shown.figures, *patterns], content, headed=False)


def report_figures(answer: RobotAnswer, source: str = "") -> list[Figure]:
    """The figures of the page of a robot's diagnosis."""
    return [*_of_answer(answer, source).figures, *unexplained_figures(answer, source)]


def _of_comparison(compared: RobotCompared, source: str) -> _PoseReport:
    outputs = compared.comparison.outputs
    return _PoseReport(compared.regression, outputs, compared.errors, None, "", source)


def comparison_html(
    compared: RobotCompared, title: str, profile: str = "", *, options: Sequence[str] = ()
) -> str:
    """The page of a robot's comparison."""
    command = CommandLine(compared.regression.dataset, profile, options)
    shown = _of_comparison(compared, command.source)
    content = comparison_sections(
        compared.comparison,
        compared.followed,
        shown.cards(),
        command,
        title=title,
        ratios=shown.ratios,
    )
    return page(title, shown.figures, content, headed=False)


def comparison_figures(compared: RobotCompared, source: str = "") -> list[Figure]:
    """The figures of the page of a robot's comparison."""
    return _of_comparison(compared, source).figures


def _of_addition(fitted: FittedRobotAddition, source: str) -> _PoseReport:
    changed = f"with {fitted.addition.added[0].label}"
    return _PoseReport(fitted.regression, fitted.addition.outputs, *fitted.errors, changed, source)


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
    shown = _of_addition(fitted, command.source)
    better = better or extended_name(command.profile, fitted.addition.added[0].effect.id)
    content = addition_sections(
        fitted.addition, shown.cards(), command, better, title=title, ratios=shown.ratios
    )
    return page(title, shown.figures, content, headed=False)


def addition_figures(fitted: FittedRobotAddition, source: str = "") -> list[Figure]:
    """The figures of the page of an effect added to a robot."""
    return _of_addition(fitted, source).figures
