"""Exchange of an effect for a rival, whose start must not be a compensated model."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis_runs import Ride, engine_for, term
from winchkit.diagnosis.verdict.equivalence import equivalence_set

ONE_WAY = Ride(samples=1500, rate=25.0, period=100.0)
"""Wound in once and not quite out again: a creep can look like a wrong length of cable."""


@pytest.mark.parametrize("radius_error", [-1e-3, -5e-4, 1e-3])
def test_an_equivalent_effect_is_found_though_the_others_compensate(
    radius_error: float,
) -> None:
    """On a grooved drum a wrong radius and a wrong ratio do the same to the last digit."""
    hidden = (
        term("drum-radius", radius_error=radius_error),
        term("cable-creep", creep_stiffness=7e5, time_constant=20.0),
    )
    engine = engine_for(hidden, ONE_WAY)
    start = engine.initial_model
    for own in hidden:
        start = start.with_term(own, engine.regression.n_runs)
    final, noise = engine.fit_with_noise(start)
    alone = engine.refit(final.hypothesis.without(0), noise).hypothesis.terms[0]
    assert abs(np.log(alone.values["creep_stiffness"] / 7e5)) > 1.0
    assert set(equivalence_set(engine, final, noise, 0).effects) == {"drum-radius", "gear-ratio"}


def test_a_fixed_hypothesis_keeps_its_values() -> None:
    creep = term("cable-creep", creep_stiffness=7e5, time_constant=20.0)
    engine = engine_for([creep], ONE_WAY)
    begin, noise = engine.fit_with_noise(engine.initial_model)
    other = begin.hypothesis.with_term(
        term("cable-creep", creep_stiffness=1e6, time_constant=5.0), engine.regression.n_runs
    )
    held = engine.fixed(other, noise)
    assert held.vector == pytest.approx(engine.regression.vector(other))
    assert engine.refit(other, noise).chi_square < held.chi_square
