"""The unexplained residual as a curve over its main variable, of winches and of robots."""

from __future__ import annotations

from math import isfinite

from winchkit.arrays import Array
from winchkit.diagnosis.diagnose import Answer, WinchAnswer
from winchkit.diagnosis.residuals.attribution import Attribution
from winchkit.diagnosis.results import Where
from winchkit.diagnosis.robot.diagnose import RobotAnswer
from winchkit.profile_edit.history import LADDER_UNITS
from winchkit.report.figures.pose_traces import trace_over
from winchkit.report.figures.reduction import curve_of
from winchkit.report.html.chart import Chart, axis_over, reading
from winchkit.report.html.markup import Markup, element
from winchkit.report.words.numbers import scale_for, unbroken
from winchkit.report.words.sentence import capital, main_patterns, where_text

__all__ = [
    "unexplained_curve",
    "unexplained_figures",
]


def unexplained_curve(answer: Answer, where: Where) -> tuple[Array, Array]:
    """Mean of the variable and of the residual in every bin, (bins,) each, SI."""
    over = Attribution(where.output, where.variable, where.share, where.order, line=where.line)
    if isinstance(answer, RobotAnswer):
        regression, errors = answer.selection.rest
        trace = trace_over(regression, over, errors)
        return trace.means(trace.before)
    assert isinstance(answer, WinchAnswer)
    curve = curve_of(answer.engine.regression, answer.result.final.residual, over)
    return curve.x, curve.mean


def unexplained_figures(answer: Answer) -> list[Markup]:
    """One figure per output; none without a residual, or where only its frequency is known."""
    if answer.diagnosis.verdict not in {"partly", "unknown"}:
        return []
    places = [w for w in main_patterns(answer.diagnosis.where) if w.frequency is None]
    figures = [_figure(answer, where) for where in places]
    return [element("div", *figures, class_="pair maps")] if figures else []


def _figure(answer: Answer, where: Where) -> Markup:
    at, residual = unexplained_curve(answer, where)
    how = reading(where.variable, within_turn=where.order is not None)
    x = [float(v) for v in how.shown(at)]
    scale = scale_for(3 * float(abs(residual).max()), LADDER_UNITS[where.output])
    mean = [float(v) / scale.worth for v in residual]
    points = [(a, b) for a, b in zip(x, mean, strict=True) if isfinite(a) and isfinite(b)]
    caption = f"Mean residual: {where_text(where)}."
    chart = Chart(
        axis_over(how.label, x, logarithmic=how.logarithmic),
        axis_over(f"residual [{scale.label}]", mean, zero=True),
        caption,
    )
    dots = [chart.dot(a, b, "residual") for a, b in points]
    drawn = chart.draw(chart.line(points, "residual"), *dots)
    return element("figure", drawn, element("figcaption", unbroken(capital(caption))))
