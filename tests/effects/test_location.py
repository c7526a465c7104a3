"""Grids and bounds of shapes that are placed in the range of the data."""

import numpy as np
import pytest

from effect_lines import CATALOGUE
from winchkit.effects.location import located
from winchkit.effects.reference_motion import standard_motion


def test_an_extent_and_its_bound_are_shares_of_the_range() -> None:
    at = standard_motion().at
    effect, extent = CATALOGUE["motor-dahl"], np.ptp(at.motor_angle)
    found = located(effect, [at]).parameter("distance")
    assert found.grid == pytest.approx([k * extent for k in effect.parameter("distance").grid])
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
