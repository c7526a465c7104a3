"""Card of a candidate: its values, fitted beside the profile, and its signature in the residual."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.linear_axis import in_units_of
from winchkit.diagnosis.regression.intervals import estimates, spread_of
from winchkit.diagnosis.residuals.traces import traces_of
from winchkit.diagnosis.results import Estimate
from winchkit.errors import UsageError
from winchkit.web.ladder import card
from winchkit.web.state import PageState


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
