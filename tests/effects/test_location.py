"""Grids and bounds of shapes that are placed in the range of the data."""

import numpy as np
import pytest

from effect_lines import CATALOGUE
from winchkit.effects.location import located
from winchkit.effects.reference_motion import standard_motion


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
