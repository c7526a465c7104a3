"""Worm gears and the cable guide."""

from __future__ import annotations

from dataclasses import replace
from math import atan, cos, pi, sin, tan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.catalog import find
from winchkit.errors import UsageError
from winchkit.model.capacity import turns_at
from winchkit.model.gearbox import worm_stage
from winchkit.model.guide import FLEET_LIMIT, Guide, guide_of, guide_warnings
from winchkit.schema.read import read_profile


@given(st.floats(0.01, 0.8), st.floats(0.0, 0.3))
def test_a_worm_is_a_wedge_with_friction(lead: float, friction: float) -> None:
    """Forces on the flank: drive t for an axial load of one, N normal to the flank."""
    stage = worm_stage(2, 60, lead, friction)
    assert stage.ratio == 30
    # Lifting: N (cos γ − μ sin γ) = 1, drive N (sin γ + μ cos γ); work in over one turn.
    normal = 1 / (cos(lead) - friction * sin(lead))
    drive = normal * (sin(lead) + friction * cos(lead))
    assert stage.efficiency == pytest.approx(tan(lead) / drive, rel=1e-9)
    # Lowering: friction turned round; it locks when the load's own drive is gone.
    normal = 1 / (cos(lead) + friction * sin(lead))
    own = normal * (sin(lead) - friction * cos(lead))
    assert stage.backward == pytest.approx(max(0.0, own / tan(lead)), rel=1e-9, abs=1e-12)
    assert stage.self_locking == (own <= 0)


@given(st.floats(0.02, 0.7), st.floats(0.0, 0.2), st.floats(0.0, 0.5))
def test_a_worm_is_as_efficient_as_the_textbooks_say(
    lead: float, friction: float, pressure: float
) -> None:
    """Shigley's form, which has neither the angle of friction nor its tangent."""
    textbook = (cos(pressure) - friction * tan(lead)) / (cos(pressure) + friction / tan(lead))
    assert worm_stage(1, 30, lead, friction, pressure).efficiency == pytest.approx(textbook)


def test_a_worm_locks_below_its_angle_of_friction() -> None:
    assert worm_stage(1, 30, 0.05, 0.06).self_locking
    assert not worm_stage(1, 30, 0.07, 0.06).self_locking
    # Steeper flanks press harder: ρ = atan(μ / cos α_n).
    assert worm_stage(1, 30, atan(0.061), 0.06, pressure_angle=np.deg2rad(20)).self_locking


@pytest.mark.parametrize(
    ("starts", "teeth", "lead", "friction"),
    [(0, 30, 0.1, 0.1), (1, 0, 0.1, 0.1), (1, 30, 0.0, 0.1), (1, 30, 1.5, 0.1), (1, 30, 0.1, -1)],
)
def test_worms_that_cannot_be_are_refused(
    starts: int, teeth: int, lead: float, friction: float
) -> None:
    with pytest.raises(UsageError, match="is impossible"):
        worm_stage(starts, teeth, lead, friction)


def test_a_guide_that_fits_its_groove_stays_over_the_cable() -> None:
    guide = Guide(0.005, 1.0, 0.4, pitch=0.005)
    angle = np.linspace(0, 100, 7)
    assert guide.mismatch == 0.0
    assert np.array_equal(guide.fleet_angle(angle), np.zeros(7))
    assert guide.turns_within(0.01) == float("inf")
    assert np.allclose(guide.position(angle), 0.005 * angle / (2 * pi))


@given(st.floats(1e-3, 2e-2), st.floats(0.2, 3), st.floats(0.1, 2), st.floats(1e-3, 2e-2))
def test_the_fleet_angle_is_reached_where_it_is_given(
    lead: float, ratio: float, distance: float, pitch: float
) -> None:
    guide = Guide(lead, ratio, distance, pitch)
    limit = float(FLEET_LIMIT["grooved"])
    turns = guide.turns_within(limit)
    if np.isfinite(turns) and turns > 0 and turns < 1e6:
        there = float(guide.fleet_angle(2 * pi * turns))
        assert abs(there) == pytest.approx(limit, rel=1e-6)
        before = float(guide.fleet_angle(2 * pi * turns * 0.99))
        assert abs(before) <= limit * (1 + 1e-9)


def test_a_guide_that_runs_away_from_the_cable_is_reported() -> None:
    """5.2 mm a turn in grooves of 5 mm: after 30 turns 6 mm aside of 100 mm are 3.4 degrees."""
    profile = read_profile(find("profiles", "bench-grooved"))
    assert profile.guide is not None
    assert list(guide_warnings(profile)) == []
    astray = replace(
        profile,
        guide=replace(profile.guide, screw_lead=5.2e-3, distance=0.1),
        drum=replace(profile.drum, groove_pitch=5e-3, width=0.15),
    )
    ((key, words),) = guide_warnings(astray)
    assert key == "guide.screw_lead"
    assert "30 turns" in words
    assert "6.0 mm" in words
    assert f"{np.degrees(np.arctan(0.06)):.2g} deg" in words
    # Two degrees are passed where 0.2 mm a turn have become 100 mm · tan 2°.
    assert f"from {100 * tan(np.deg2rad(2)) / 0.2:.3g} turns on" in words
    # A stroke that stays below that is well.
    short = turns_at(astray, 8.0)
    told = bool(list(guide_warnings(astray, 8.0)))
    assert told == (short > 100 * tan(np.deg2rad(2)) / 0.2)


def test_the_guide_of_a_profile() -> None:
    guide = guide_of(read_profile(find("profiles", "bench-grooved")))
    assert guide == Guide(0.005, 1.0, 0.4, 0.005)
    bare = replace(read_profile(find("profiles", "bench-grooved")), guide=None)
    with pytest.raises(UsageError, match="has no"):
        guide_of(bare)
