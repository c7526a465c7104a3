"""Grids and bounds of shapes that are placed in the range of the data."""

from dataclasses import replace

import numpy as np
import pytest

from effect_lines import CATALOGUE
from winchkit.effects.location import located
from winchkit.effects.reference_motion import standard_motion
from winchkit.effects.transition import TRANSITION, with_free_transition


def test_an_extent_and_its_bound_are_shares_of_the_range() -> None:
    at = standard_motion().at
    effect, extent = CATALOGUE["motor-dahl"], np.ptp(at.motor_angle)
    declared, found = (e.parameter("distance") for e in (effect, located(effect, [at])))
    shares = [share for share in declared.grid if share * extent < declared.high]
    assert 0 < len(shares) < len(declared.grid), "a longer distance is no presliding"
    assert found.grid == pytest.approx([share * extent for share in shares])
    assert found.low == pytest.approx(found.grid[0] / 10)


def test_a_place_keeps_its_bounds_and_other_effects_are_unchanged() -> None:
    at = standard_motion().at
    effect = CATALOGUE["friction-at-place"]
    found = located(effect, [at]).parameter("place")
    assert (found.low, found.high) == (
        effect.parameter("place").low,
        effect.parameter("place").high,
    )
    assert located(CATALOGUE["motor-coulomb"], [at]) is CATALOGUE["motor-coulomb"]


@pytest.mark.parametrize(
    ("name", "parameter"), [("torque-lag", "time_constant"), ("torque-lead", "lead")]
)
def test_a_delay_is_within_a_filter_and_a_bus_or_two_samples(name: str, parameter: str) -> None:
    at = standard_motion().at
    found = located(CATALOGUE[name], [at]).parameter(parameter)
    assert (found.low, found.high) == (0.0, 0.2)
    slow = replace(at, time=np.arange(len(at.time)) * 0.5)
    assert located(CATALOGUE[name], [slow]).parameter(parameter).high == 1.0


def test_a_transition_is_fitted_up_to_the_largest_that_is_one() -> None:
    found = with_free_transition(CATALOGUE["motor-coulomb"], 0.1).parameter(TRANSITION)
    assert 0.0 < found.low < found.high == 0.1
