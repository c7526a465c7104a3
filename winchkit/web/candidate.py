"""Answers of the Diagnose view: a candidate's card, a pattern's curve, and a refitted addition."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.add import fitted_addition_to
from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.diagnose import WinchAnswer
from winchkit.diagnosis.linear_axis import in_units_of
from winchkit.diagnosis.regression.intervals import estimates, spread_of
from winchkit.diagnosis.residuals.attribution import Attribution
from winchkit.diagnosis.residuals.traces import traces_of
from winchkit.diagnosis.results import Estimate, OutputFit, Step
from winchkit.diagnosis.write import write_addition
from winchkit.effects.catalogue import Catalogue
from winchkit.effects.empirical import EMPIRICAL, empirical_id
from winchkit.errors import UsageError
from winchkit.quantity_text import percent, quantity
from winchkit.report.figures.reduction import strongest
from winchkit.report.words.vocabulary import effect_name, output_name
from winchkit.web.curves import curves_of
from winchkit.web.model_errors import ModelErrors, card, patterns_of
from winchkit.web.state import PageState, Version


def candidate_card(state: PageState, effect_id: str) -> dict[str, Any]:
    """Card of a candidate with its signature; raises UsageError for an effect that is none."""
    answer = state.diagnosed
    engine, result = answer.engine, answer.result
    item = next((s for s in result.scores if s.candidate.effect.id == effect_id), None)
    if item is None:
        raise UsageError(f"effect '{effect_id}' is no candidate for these runs")
    initial, noise = result.initial_model, result.noise
    fitted = engine.trial(initial, item, noise).fit
    change = initial.residual - fitted.residual
    values: Mapping[str, Estimate] = {}
    spread = spread_of(engine.regression, fitted, noise, engine.regression.blocks)
    for term, own in estimates(engine.regression, fitted, spread):
        if term.effect.id == effect_id:
            values = own
    equal = next((step.effects for step in answer.diagnosis.steps if effect_id in step.effects), ())
    out = card(answer, item.candidate.effect, values, [e for e in equal if e != effect_id])
    drawn = _most_changed(state, item.candidate.effect.outputs, change)
    profile = engine.regression.dataset.profile
    if drawn is not None:
        output, own_change = in_units_of(profile, drawn)
        curves = state.curves[output]
        found = curves.main_variable(own_change)
        if found is None and (where := state.order_of(output)) is not None:
            found = where.variable, where.order
        variable, periods = found or (next(iter(curves.shares)), None)
        out["signature"] = curves.signature(own_change, variable, periods)
        out["signature"]["variable"] = variable
    return in_units_of(profile, out)


def _most_changed(
    state: PageState, outputs: Sequence[str], change: Array
) -> tuple[str, Array] | None:
    """Output that a candidate changes most against its noise, and the change in time."""
    regression = state.diagnosed.engine.regression
    traces = traces_of(regression, change)
    best: tuple[float, str, Array] | None = None
    for name in outputs:
        parts = [trace.residual for trace in traces if trace.output == name]
        if not parts:
            continue
        own = np.concatenate(parts)
        size = float(np.sqrt(np.nanmean(own**2))) / (
            state.curves[in_units_of(regression.dataset.profile, name)].noise or 1.0
        )
        if best is None or size > best[0]:
            best = size, name, own
    return None if best is None else best[1:]


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


def refit(
    state: PageState, effect: str, dataset: Dataset, catalogue: Catalogue, folder: Path
) -> PageState:
    """State with an effect in the profile, refitted but not yet diagnosed; raises UsageError."""
    answer = state.answer
    if answer is None:
        raise UsageError("nothing is diagnosed yet")
    if effect not in catalogue:
        raise UsageError(f"there is no effect '{effect}'")
    fitted = fitted_addition_to(effect, dataset, catalogue)
    path = folder / f"version-{len(state.versions)}.toml"
    names = [item.name for item in state.used]
    write_addition(state.versions[-1].path, fitted.addition, names, path, replace=True)
    outputs = fitted.addition.outputs
    before = {name: out.heldout_rms_before for name, out in outputs.items()}
    label = (
        "Profile as loaded"
        if len(state.versions) == 1
        else f"+ {effect_name(state.versions[-1].added)}"
    )
    now = {
        name: replace(out, heldout_rms_before=out.heldout_rms_after)
        for name, out in outputs.items()
    }
    shown = replace(answer.diagnosis, outputs=now, steps=(), candidates=(), where=())
    noise = {name: out.noise_rms for name, out in outputs.items()}
    return replace(
        state,
        versions=(*state.versions, Version(path, effect)),
        earlier=(*state.earlier, ModelErrors(label, before)),
        said=_said(outputs),
        answer=WinchAnswer(answer.engine, answer.result, shown),
        refitted=True,
        curves=curves_of(fitted.regression, fitted.final.residual, noise),
        before=(answer, state.curves),
        faults=(),
    )


def _said(outputs: Mapping[str, OutputFit]) -> str:
    """Error of the output whose error fell most, after and before."""

    def fall(name: str) -> float:
        return outputs[name].heldout_rms_before / max(outputs[name].heldout_rms_after, 1e-300)

    name = max(outputs, key=fall)
    out = outputs[name]
    after, before = (quantity(v, out.unit) for v in (out.heldout_rms_after, out.heldout_rms_before))
    return f"{output_name(name).capitalize()} error {after}, was {before}"
