"""A rival in the place of an effect: what makes up for the effect must not keep the rival out."""

from __future__ import annotations

import numpy as np
import pytest
from diagnosis_runs import Ride, inquiry_into, term

from winchkit.diagnosis.verdict.equivalence import confusion_of

ONE_WAY = Ride(samples=1500, rate=25.0, period=100.0)
"""Wound in once and not quite out again: a creep can look like a wrong length of rope."""


@pytest.mark.parametrize("radius_error", [-1e-3, -5e-4, 1e-3])
def test_a_set_holds_what_explains_the_same_though_the_rest_made_up_for_it(
    radius_error: float,
) -> None:
    """On a grooved drum a wrong radius and a wrong ratio do the same to the last digit."""
    hidden = (
        term("drum-radius", radius_error=radius_error),
        term("cable-creep", creep_stiffness=7e5, time_constant=20.0),
    )
    inquiry = inquiry_into(hidden, ONE_WAY)
    start = inquiry.begin
    for own in hidden:
        start = start.with_term(own, inquiry.problem.runs)
    final, noise = inquiry.settle(start)
    alone = inquiry.refit(final.hypothesis.without(0), noise).hypothesis.terms[0]
    assert abs(np.log(alone.values["creep_stiffness"] / 7e5)) > 1.0
    assert set(confusion_of(inquiry, final, noise, 0).effects) == {"drum-radius", "gear-ratio"}


def test_held_as_it_is_a_hypothesis_keeps_its_values() -> None:
    creep = term("cable-creep", creep_stiffness=7e5, time_constant=20.0)
    inquiry = inquiry_into([creep], ONE_WAY)
    begin, noise = inquiry.settle(inquiry.begin)
    other = begin.hypothesis.with_term(
        term("cable-creep", creep_stiffness=1e6, time_constant=5.0), inquiry.problem.runs
    )
    held = inquiry.held(other, noise)
    assert held.vector == pytest.approx(inquiry.problem.vector(other))
    assert inquiry.refit(other, noise).cost < held.cost
