"""The unexplained rest, drawn along what it lives over."""

from __future__ import annotations

from math import isfinite

from winchkit.diagnosis.diagnose import Answer
from winchkit.diagnosis.ladder import LADDER_UNITS
from winchkit.diagnosis.report.axes import reading
from winchkit.diagnosis.report.chart import Chart, axis_over
from winchkit.diagnosis.report.markup import Markup, element
from winchkit.diagnosis.report.rest import rest_of
from winchkit.diagnosis.report.sentence import capital, telling, where_text
from winchkit.diagnosis.report.wording import scale_for, unbroken
from winchkit.diagnosis.result import Where

__all__ = ["rest_figures"]


def rest_figures(answer: Answer) -> list[Markup]:
    """One figure per output; none where nothing is left, or where only a frequency is known."""
    if answer.diagnosis.verdict not in {"partly", "unknown"}:
        return []
    places = [w for w in telling(answer.diagnosis.where) if w.frequency is None]
    figures = [_figure(answer, where) for where in places]
    return [element("div", *figures, class_="pair maps")] if figures else []


def _figure(answer: Answer, where: Where) -> Markup:
    at, residual = rest_of(answer, where)
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
