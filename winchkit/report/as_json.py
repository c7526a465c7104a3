"""A diagnosis as JSON with everything that its page shows."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from winchkit import wings
from winchkit.arrays import Array
from winchkit.diagnosis.diagnose import Answer, WinchAnswer
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.residuals.maps import residual_maps
from winchkit.report.detectability import untestable
from winchkit.report.figures.reduction import curve_of, strongest
from winchkit.report.figures.waterfall import Waterfall, waterfall_of
from winchkit.report.words.sentence import changes_text, sentence


def report_json(answer: Answer) -> dict[str, Any]:
    """A diagnosis as ``winchkit diagnose --json`` prints it, in SI."""
    diagnosis, parts = answer.diagnosis, waterfall_of(answer)
    if (by_wing := wings.call("json", answer)) is not None:
        drawn = by_wing(answer)
    else:
        assert isinstance(answer, WinchAnswer)
        drawn = _of_runs(answer)
    return {
        **diagnosis.to_json(),
        "sentence": sentence(diagnosis),
        "would_change": changes_text(diagnosis),
        "not_looked_for": [{"effect": e, "needs": list(needs)} for e, needs in untestable(answer)],
        "evidence_of_noise": max(answer.result.threshold, 0.0),
        "waterfall": None if parts is None else _waterfall(parts),
        **drawn,
    }


def _of_runs(answer: WinchAnswer) -> dict[str, Any]:
    return {"residuals": _states(answer, _curves), "maps": _states(answer, _maps)}


def _states(
    answer: WinchAnswer, drawn: Callable[[TimeSeriesRegression, Array], list[Any]]
) -> dict[str, Any]:
    """Curves or maps of the residual before, and after where an effect was named."""
    found, regression = answer.result, answer.engine.regression
    after = drawn(regression, found.final.residual) if answer.diagnosis.steps else None
    return {"before": drawn(regression, found.initial_model.residual), "after": after}


def _curves(regression: TimeSeriesRegression, residual: Array) -> list[Any]:
    found = strongest(regression, residual).values()
    return [curve_of(regression, residual, over).to_json() for over in found]


def _maps(regression: TimeSeriesRegression, residual: Array) -> list[Any]:
    return [drawn.to_json() for drawn in residual_maps(regression, residual)]


def _waterfall(parts: Waterfall) -> dict[str, Any]:
    return {
        "steps": [{"model": name, "heldout_rms": dict(rms)} for name, rms in parts.steps],
        "first": {name: dict(rms) for name, rms in parts.first.items()},
        "last": {name: dict(rms) for name, rms in parts.last.items()},
    }
