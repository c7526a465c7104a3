"""The unexplained residual as a curve over its main variable, of winches and of robots."""

from __future__ import annotations

from winchkit.arrays import Array
from winchkit.diagnosis.diagnose import Answer, WinchAnswer
from winchkit.diagnosis.residuals.attribution import Attribution
from winchkit.diagnosis.robot.diagnose import RobotAnswer
from winchkit.profile_edit.history import LADDER_UNITS
from winchkit.report.figures.axes import reading
from winchkit.report.figures.figure import Axis, Figure, Panel, Series
from winchkit.report.figures.pose_traces import trace_over
from winchkit.report.figures.reduction import curve_of
from winchkit.report.words.numbers import scale_for
from winchkit.report.words.sentence import capital, main_patterns, where_text
from winchkit.report.words.vocabulary import OUTPUT_NAMES, VARIABLE_NAMES

__all__ = [
    "unexplained_curve",
    "unexplained_figures",
]


def unexplained_curve(answer: Answer, where: Attribution) -> tuple[Array, Array]:
    """Mean of the variable and of the residual in every bin, (bins,) each, SI."""
    if isinstance(answer, RobotAnswer):
        regression, errors = answer.selection.rest
        trace = trace_over(regression, where, errors)
        return trace.means(trace.before)
    assert isinstance(answer, WinchAnswer)
    curve = curve_of(answer.engine.regression, answer.result.final.residual, where)
    return curve.x, curve.mean


def unexplained_figures(answer: Answer, source: str = "") -> list[Figure]:
    """One figure per output; none without a residual, or where only its frequency is known."""
    if answer.diagnosis.verdict not in {"partly", "unknown"}:
        return []
    places = [w for w in main_patterns(answer.diagnosis.where) if w.frequency is None]
    return [_figure(answer, where, source) for where in places]


def _figure(answer: Answer, where: Attribution, source: str) -> Figure:
    at, residual = unexplained_curve(answer, where)
    how = reading(where.variable, within_turn=where.order is not None)
    scale = scale_for(3 * float(abs(residual).max()), LADDER_UNITS[where.output])
    noise = None
    if isinstance(answer, WinchAnswer):
        noise = answer.diagnosis.outputs[where.output].noise_rms
    output = OUTPUT_NAMES.get(where.output, where.output)
    over = VARIABLE_NAMES.get(where.variable, where.variable)
    return Figure(
        f"pattern-{where.output}",
        capital(f"{output}, mean residual over {over}"),
        f"Mean residual: {where_text(where)}.",
        how.axis(),
        (
            Panel(
                Axis("residual", scale.label, zero=True),
                (Series("residual, mean", "today", how.shown(at), residual / scale.worth, "mean"),),
                None if noise is None else noise / scale.worth,
            ),
        ),
        source=source,
    )
