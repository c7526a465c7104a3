"""The unexplained residual as a curve over its main variable, and open laws beside their curve."""

from __future__ import annotations

from winchkit import wings
from winchkit.arrays import Array
from winchkit.diagnosis.diagnose import Answer, WinchAnswer
from winchkit.diagnosis.residuals.attribution import Attribution
from winchkit.diagnosis.results import Step
from winchkit.effects.empirical import shown_id
from winchkit.profile_edit.history import ERROR_UNITS
from winchkit.quantity_text import scale_for
from winchkit.report.figures.axes import reading
from winchkit.report.figures.figure import Figure, FigureAxis, FigureSeries, Panel
from winchkit.report.figures.reduction import curve_of, strongest
from winchkit.report.words.sentence import capital, main_patterns, where_text
from winchkit.report.words.steps import has_other_law
from winchkit.report.words.vocabulary import output_name, variable_name


def unexplained_curve(answer: Answer, where: Attribution) -> tuple[Array, Array]:
    """Mean of the variable and of the residual in every bin, (bins,) each, SI."""
    if (by_wing := wings.call("unexplained", answer)) is not None:
        at, mean = by_wing(answer, where)
        return at, mean
    assert isinstance(answer, WinchAnswer)
    curve = curve_of(answer.engine.regression, answer.result.final.residual, where)
    return curve.x, curve.mean


def unexplained_figures(answer: Answer, source: str = "") -> list[Figure]:
    """One figure per output; none without a residual, or where only its frequency is known."""
    if answer.diagnosis.verdict not in {"partly", "unknown", "undecided"}:
        return []
    places = [w for w in main_patterns(answer.diagnosis.where) if w.frequency is None]
    return [_figure(answer, where, source) for where in places]


def _figure(answer: Answer, where: Attribution, source: str) -> Figure:
    at, residual = unexplained_curve(answer, where)
    how = reading(where.variable, within_turn=where.order is not None)
    scale = scale_for(3 * float(abs(residual).max()), ERROR_UNITS[where.output])
    noise = None
    if isinstance(answer, WinchAnswer):
        noise = answer.diagnosis.outputs[where.output].noise_rms
    output = output_name(where.output)
    over = variable_name(where.variable)
    means = FigureSeries("residual, mean", "today", how.shown(at), residual / scale.worth, "mean")
    band = None if noise is None else noise / scale.worth
    return Figure(
        f"pattern-{where.output}",
        capital(f"{output}, mean residual over {over}"),
        f"Mean residual: {where_text(where)}.",
        how.axis(),
        (Panel(FigureAxis("residual", scale.label, zero=True), (means,), band),),
        source=source,
    )


def open_law_figures(answer: Answer, source: str = "") -> list[Figure]:
    """Per step whose law is another one: what it has to explain, with the closest law."""
    if not isinstance(answer, WinchAnswer):
        return []
    engine, result = answer.engine, answer.result
    steps = answer.diagnosis.steps
    added = len(result.final.hypothesis.terms) - engine.n_initial_terms
    out = []
    for place, step in enumerate(steps[max(0, len(steps) - added) :]):
        if has_other_law(step):
            index = engine.n_initial_terms + place
            model = result.final.hypothesis.without(index)
            without = engine.refit(model, result.noise).residual
            figure = _open_law(answer, step, without, source)
            out += [figure] if figure is not None else []
    return out


def _open_law(answer: WinchAnswer, step: Step, without: Array, source: str) -> Figure | None:
    """Mean residual ``without`` the step, (rows,), over its variable, and its law there."""
    regression = answer.engine.regression
    known = {over.output: over for over in strongest(regression, without).values()}
    over = next((known[place.output] for place in step.place if place.output in known), None)
    if over is None:
        return None
    at = curve_of(regression, without, over)
    law = curve_of(regression, without - answer.result.final.residual, over)
    how = reading(over.variable, within_turn=over.order is not None)
    scale = scale_for(3 * float(abs(at.mean).max()), ERROR_UNITS[over.output])
    output, variable = output_name(over.output), variable_name(over.variable)
    drawn = tuple(
        FigureSeries(name, tone, how.shown(curve.x), curve.mean / scale.worth, "mean")
        for name, tone, curve in (("to explain, mean", "today", at), (step.effects[0], "with", law))
    )
    return Figure(
        f"law-{step.effects[0]}",
        capital(f"{output} over {variable}, and the closest law"),
        f"Mean residual without {step.effects[0]}, and what this law explains of it; 'winchkit add "
        f"{shown_id(over.output, over.variable)}' adds the curve.",
        how.axis(),
        (Panel(FigureAxis("residual", scale.label, zero=True), drawn),),
        source=source,
    )
