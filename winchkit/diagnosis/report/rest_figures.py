"""The unexplained rest, drawn along what it lives over."""

from __future__ import annotations

from math import isfinite

from winchkit.diagnosis.admit import OUTPUT_UNITS
from winchkit.diagnosis.diagnose import Answer
from winchkit.diagnosis.follows import Followed
from winchkit.diagnosis.report.axes import reading
from winchkit.diagnosis.report.chart import Chart, axis_over
from winchkit.diagnosis.report.curves import curve_of
from winchkit.diagnosis.report.markup import Markup, element
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
    over = Followed(where.output, where.variable, where.share, where.order)
    curve = curve_of(answer.inquiry.problem, answer.found.final.residual, over)
    how = reading(where.variable, within_turn=where.order is not None)
    x = [float(v) for v in how.shown(curve.x)]
    scale = scale_for(3 * float(abs(curve.mean).max()), OUTPUT_UNITS[where.output])
    mean = [float(v) / scale.worth for v in curve.mean]
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
