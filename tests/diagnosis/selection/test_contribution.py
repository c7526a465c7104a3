"""Order of the effects of a final model, and those that change nothing."""

from __future__ import annotations

from dataclasses import replace

import pytest

from diagnosis_runs import Ride, engine_for, term
from winchkit.diagnosis.selection.contribution import ordered_by_contribution
from winchkit.diagnosis.selection.stepwise import initial_result


@pytest.mark.parametrize("last", [0.0, 0.005])
def test_the_largest_comes_first_and_an_amplitude_at_its_null_is_no_effect(last: float) -> None:
    drag, viscous = term("motor-coulomb", torque=0.02), term("motor-viscous", viscosity=last)
    engine = engine_for([drag, viscous], Ride())
    start = initial_result(engine)
    hypothesis = start.final.hypothesis
    for added in (viscous, drag):
        hypothesis = hypothesis.with_term(added, engine.regression.n_runs)
    final = replace(start.final, hypothesis=hypothesis)
    found = ordered_by_contribution(engine, replace(start, final=final)).final.hypothesis
    names = [t.effect.id for t in found.terms[engine.n_initial_terms :]]
    assert names == (["motor-viscous"] if last else []) + ["motor-coulomb"]
