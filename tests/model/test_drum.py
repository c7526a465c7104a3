"""Drums against brute force, their own derivative and their inverse."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.model.drum import Archimedean, Grooved, Spiral, Squared, drum_of
from winchkit.schema.profiles.winch import (
    CableSpec,
    DrumSpec,
    GearboxSpec,
    ReferenceSpec,
    WinchProfile,
)

TURN = 2 * pi
radii = st.floats(0.01, 1.0)
angles = st.floats(-30.0, 600.0)
shares = st.floats(0.0, 0.5)


@st.composite
def drums(draw: st.DrawFn) -> Spiral | Archimedean | Grooved | Squared:
    radius, share = draw(radii), draw(shares)
    kind = draw(st.sampled_from([Spiral, Archimedean, Grooved, Squared]))
    # A squared drum's build-up is an area per length; this one grows by share·r a turn.
    second = share * radius / pi if kind is Squared else share * radius
    return kind(radius, second)


@given(drums(), angles)
def test_angle_is_the_inverse_of_wound(
    drum: Spiral | Archimedean | Grooved | Squared, angle: float
) -> None:
    there = drum.wound(np.asarray(angle))
    assert float(drum.angle(there)) == pytest.approx(angle, rel=1e-9, abs=1e-9)


@given(drums(), st.lists(angles, min_size=2, max_size=20))
def test_more_angle_is_more_cable_and_arrays_agree_with_numbers(
    drum: Spiral | Archimedean | Grooved | Squared, some: list[float]
) -> None:
    angle = np.sort(np.array(some))
    wound = drum.wound(angle)
    assert np.all(np.diff(wound) >= 0)
    assert wound.tolist() == [float(drum.wound(np.asarray(x))) for x in angle]
    assert drum.arm(angle).shape == angle.shape


@given(drums(), angles)
def test_arm_is_the_derivative_of_wound(
    drum: Spiral | Archimedean | Grooved | Squared, angle: float
) -> None:
    h = 1e-4
    into_turn = angle % TURN
    near_a_kink = min(into_turn, TURN - into_turn) < 2 * h
    if near_a_kink:
        return
    slope = (drum.wound(np.asarray(angle + h)) - drum.wound(np.asarray(angle - h))) / (2 * h)
    assert float(drum.arm(np.asarray(angle))) == pytest.approx(float(slope), rel=1e-6)


@given(radii, shares, st.floats(0.0, 400.0))
def test_spiral_is_the_sum_of_its_turns(radius: float, share: float, angle: float) -> None:
    growth = share * radius
    left, layer, total = angle, 0, 0.0
    while left > TURN:
        total += TURN * (radius + layer * growth)
        left, layer = left - TURN, layer + 1
    total += left * (radius + layer * growth)
    assert float(Spiral(radius, growth).wound(np.asarray(angle))) == pytest.approx(total, rel=1e-9)


@given(radii, shares, st.integers(1, 60))
def test_spiral_is_continuous_where_a_layer_begins(radius: float, share: float, n: int) -> None:
    drum = Spiral(radius, share * radius)
    below, above = drum.wound(np.array([TURN * n * (1 - 1e-12), TURN * n * (1 + 1e-12)]))
    assert above - below == pytest.approx(0.0, abs=1e-6 * radius)
    step = drum.arm(np.array([TURN * (n - 0.5), TURN * (n + 0.5)]))
    assert step[1] - step[0] == pytest.approx(share * radius, abs=1e-12)


@given(radii, shares, angles)
def test_archimedean_is_the_integral_of_its_arm(radius: float, share: float, angle: float) -> None:
    drum = Archimedean(radius, share * radius)
    # The arm is linear on each side of zero, where the trapezoidal rule is exact.
    ends = np.array([0.0, angle])
    integral = angle * float(np.mean(drum.arm(ends)))
    assert float(drum.wound(np.asarray(angle))) == pytest.approx(integral, rel=1e-12, abs=1e-15)


@given(radii, st.floats(0.0, 0.01), st.floats(0.0, 400.0))
def test_squared_drum_keeps_the_cable_volume(radius: float, build_up: float, angle: float) -> None:
    drum = Squared(radius, build_up)
    wound, arm = float(drum.wound(np.asarray(angle))), float(drum.arm(np.asarray(angle)))
    assert arm**2 == pytest.approx(radius**2 + build_up * wound, rel=1e-12)


@given(radii, shares)
def test_grooved_turn_is_a_helix(radius: float, share: float) -> None:
    pitch = share * radius
    steps = np.linspace(0, TURN, 2001)
    points = np.column_stack([radius * np.cos(steps), radius * np.sin(steps), pitch * steps / TURN])
    chord = np.sum(np.linalg.norm(np.diff(points, axis=0), axis=1))
    turn = float(Grooved(radius, pitch).wound(np.asarray(TURN)))
    assert turn == pytest.approx(chord, rel=1e-6)


def test_without_growth_all_laws_are_one() -> None:
    angle = np.linspace(-10, 100, 300)
    for drum in (Spiral(0.06, 0), Archimedean(0.06, 0), Grooved(0.06, 0), Squared(0.06, 0)):
        assert np.allclose(drum.wound(angle), 0.06 * angle, rtol=1e-14)
        assert np.allclose(drum.arm(angle), 0.06)


def test_a_profile_makes_its_drum_and_layers_grow_by_the_cable_by_default() -> None:
    def made(spec: DrumSpec) -> object:
        return drum_of(
            WinchProfile("w", spec, ReferenceSpec(), GearboxSpec(10.0), CableSpec(diameter=0.006))
        )

    assert made(DrumSpec("spiral", 0.06)) == Spiral(0.06, 0.006)
    assert made(DrumSpec("spiral", 0.06, layer_growth=0.005)) == Spiral(0.06, 0.005)
    assert made(DrumSpec("archimedean", 0.06)) == Archimedean(0.06, 0.006)
    assert made(DrumSpec("grooved", 0.06, groove_pitch=0.007)) == Grooved(0.06, 0.007)
    assert made(DrumSpec("squared", 0.06, build_up=1e-5)) == Squared(0.06, 1e-5)
