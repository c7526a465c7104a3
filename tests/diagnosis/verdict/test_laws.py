"""Simpler laws in place of those that a selection found."""

from __future__ import annotations

import pytest

from diagnosis_runs import Ride, engine_for, term
from winchkit.diagnosis.verdict.laws import transfers
from winchkit.effects.term import Term


@pytest.mark.parametrize(
    ("hidden", "expected"),
    [
        (term("cable-elongation-linear", axial_stiffness=4e6), True),
        (term("cable-elongation-exponential", strain_scale=1.1e-4, force_scale=30.0), False),
    ],
)
def test_a_simpler_law_must_predict_another_load(hidden: Term, expected: bool) -> None:
    """A straight line fits two loads nearly as well as a bend, and neither from the other."""
    engine = engine_for((hidden,), Ride(samples=1600), (53.5, 18.7))
    start, noise = engine.fit_with_noise(engine.initial_model)
    fits = {}
    for item in engine.scores(start, noise):
        name = item.candidate.effect.id
        if name in {"cable-elongation-linear", "cable-elongation-quartic"}:
            fits[name] = engine.trial(start, item, noise).fit
    linear, quartic = fits["cable-elongation-linear"], fits["cable-elongation-quartic"]
    assert transfers(engine, linear, quartic, noise) == expected
