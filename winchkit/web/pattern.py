"""Open laws and unexplained patterns of a diagnosis: the curve to explain, and the closest law."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.diagnose import WinchAnswer
from winchkit.diagnosis.linear_axis import in_units_of
from winchkit.diagnosis.residuals.attribution import Attribution
from winchkit.diagnosis.residuals.traces import traces_of
from winchkit.diagnosis.results import Step
from winchkit.effects.empirical import EMPIRICAL, empirical_id
from winchkit.errors import UsageError
from winchkit.quantity_text import percent
from winchkit.report.figures.reduction import strongest
from winchkit.report.words.vocabulary import effect_name
from winchkit.web.ladder import patterns_of
from winchkit.web.state import PageState


def pattern(state: PageState, number: int) -> dict[str, Any]:
    """A pattern with its curve, that of the closest law, and the effect that adds it as a curve."""
    answer = state.diagnosed
    known = patterns_of(answer.diagnosis)
    if not 0 <= number < len(known):
        raise UsageError("this pattern is no longer there; the page has a newer diagnosis")
    title, at = known[number]
    final = answer.result.final.residual
    step = answer.diagnosis.steps[at] if isinstance(at, int) else None
    residual = final if step is None else _without(answer, answer.diagnosis.steps.index(step))
    where = at if isinstance(at, Attribution) else _variable(answer, step, residual)
    profile = answer.engine.regression.dataset.profile
    curves = state.curves[where.output]
    own = replace(curves, residual=_of(answer, residual, where.output))
    change = _of(answer, residual - final, where.output)
    drawn = own.signature(change, where.variable, where.order)
    curve = empirical_id(where.output, where.variable)
    return {
        "title": in_units_of(profile, title),
        "closest": "" if step is None else effect_name(step.effects[0]),
        "share": percent(where.share),
        "curve": curve if curve in EMPIRICAL else "",
        **(drawn if step is not None else drawn | {"signature": None}),
    }


def _without(answer: WinchAnswer, index: int) -> Array:
    """Residual of the final model without a step, (rows,)."""
    engine, result = answer.engine, answer.result
    terms = len(result.final.hypothesis.terms)
    place = terms - len(answer.diagnosis.steps) + index
    return engine.refit(result.final.hypothesis.without(place), result.noise).residual


def _variable(answer: WinchAnswer, step: Step | None, residual: Array) -> Attribution:
    """Variable over which a step's residual is drawn: the strongest in one of its outputs."""
    found = strongest(answer.engine.regression, residual)
    own = [place.output for place in step.place] if step is not None else []
    for output in own:
        if output in found:
            return found[output]
    raise UsageError("the residual follows no variable; the report has it over time")


def _of(answer: WinchAnswer, residual: Array, output: str) -> Array:
    """Values of an output in all runs, one after another, (n,)."""
    regression = answer.engine.regression
    traces = traces_of(regression, residual)
    names = {one: in_units_of(regression.dataset.profile, one) for one in regression.outputs}
    return np.concatenate([t.residual for t in traces if names.get(t.output) == output])
