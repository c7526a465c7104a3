"""The numbers in which every effect of the catalogue is fitted."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from diagnosis_runs import CATALOGUE
from winchkit.effects.effect import Effect
from winchkit.effects.parametrization import Coordinates

EFFECTS = list(CATALOGUE)
every = pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.id)


def drawn(effect: Effect, data: st.DataObject) -> np.ndarray:
    """Coordinates within bounds, of usual sizes and a few times that."""
    low, high = Coordinates(effect).bounds()
    ends = zip(np.maximum(low, -5.0), np.minimum(high, 5.0), strict=True)
    return np.array([data.draw(st.floats(float(a), float(b))) for a, b in ends])


@every
@settings(max_examples=15, deadline=None)
@given(data=st.data())
def test_there_and_back(effect: Effect, data: st.DataObject) -> None:
    coordinates = Coordinates(effect)
    x = drawn(effect, data)
    values = coordinates.values(x, effect.null)
    assert set(values) == set(effect.null)
    for parameter in effect.parameters:
        assert parameter.low <= values[parameter.name] <= parameter.high
    again = coordinates.values(coordinates.vector(values), effect.null)
    for name, value in values.items():
        if effect.polar and name == effect.polar[1] and values[effect.polar[0]] == 0.0:
            continue  # what has no size has no phase
        assert again[name] == pytest.approx(value, rel=1e-9, abs=1e-12)


@every
def test_an_effect_that_vanishes_is_at_zero(effect: Effect) -> None:
    coordinates = Coordinates(effect)
    at = coordinates.vector(effect.null)
    assert len(at) == len(coordinates)
    assert np.allclose(at[: len(coordinates.amplitudes)], 0.0)
    back = coordinates.values(at, effect.null)
    for parameter in coordinates.amplitudes:
        assert back[parameter.name] == pytest.approx(parameter.null)


@every
@settings(max_examples=10, deadline=None)
@given(data=st.data(), reach=st.floats(0.1, 5.0))
def test_an_interval_around_a_coordinate_has_the_value_inside(
    effect: Effect, data: st.DataObject, reach: float
) -> None:
    """Also where it reaches beyond the null, which for a stiffness is an infinite one."""
    coordinates = Coordinates(effect)
    x = drawn(effect, data)
    polar = {name for pair in effect.polar_pairs for name in pair}
    here = coordinates.values(x, effect.null)
    for index, name in enumerate(coordinates.names):
        if name in polar:
            continue
        ends = []
        for side in (-reach, reach):
            moved = x.copy()
            moved[index] += side
            ends.append(coordinates.values(moved, effect.null)[name])
        assert min(ends) <= here[name] <= max(ends)


@every
def test_usual_sizes_are_near_one_and_within_bounds(effect: Effect) -> None:
    coordinates = Coordinates(effect)
    low, high = coordinates.bounds()
    assert np.all(low <= high)
    for usual_step in coordinates.usual_steps():
        x = coordinates.vector({**effect.null, **usual_step})
        assert np.all((low <= x) & (x <= high))
        assert 0.01 <= np.abs(x[: len(coordinates.amplitudes)]).max() <= 100


@every
def test_every_point_of_the_grid_is_a_shape_that_can_be(effect: Effect) -> None:
    grid = Coordinates(effect).grid()
    assert grid
    for point in grid:
        for name, value in point.items():
            parameter = effect.parameter(name)
            assert parameter.low <= value <= parameter.high


@every
@settings(max_examples=10, deadline=None)
@given(data=st.data())
def test_deviations_are_those_of_the_derivative(effect: Effect, data: st.DataObject) -> None:
    """Against the whole of the delta method, Σ (∂value/∂xᵢ)² σᵢ², by central differences."""
    coordinates = Coordinates(effect)
    low, high = coordinates.bounds()
    # Away from bounds, where values stop following, and from zero, where 1/x has no derivative.
    x = np.clip(np.abs(drawn(effect, data)) + 0.3, low + 0.05, high - 0.05)
    std = np.array([data.draw(st.floats(1e-3, 0.02)) for _ in x])
    expected = dict.fromkeys((p.name for p in effect.parameters), 0.0)
    for index, size in enumerate(std):
        ends = []
        for sign in (1, -1):
            moved = x.copy()
            moved[index] += sign * 1e-6
            ends.append(coordinates.values(moved, effect.null))
        for name in expected:
            slope = (ends[0][name] - ends[1][name]) / 2e-6
            expected[name] += (slope * size) ** 2
    found = coordinates.deviations(x, std, effect.null)
    for name, value in found.items():
        assert value == pytest.approx(np.sqrt(expected[name]), rel=0.01, abs=1e-12)


def test_a_stiffness_is_fitted_as_a_compliance() -> None:
    effect = CATALOGUE["cable-elongation-linear"]
    coordinates = Coordinates(effect)
    typical = effect.parameter("axial_stiffness").typical
    assert coordinates.vector({"axial_stiffness": np.inf}) == [0.0]
    assert coordinates.vector({"axial_stiffness": typical / 3}) == pytest.approx([3.0])
    low, high = coordinates.bounds()
    assert low == [0.0]
    assert high == pytest.approx([typical / effect.parameter("axial_stiffness").low])


def test_a_phase_is_fitted_as_cosine_and_sine() -> None:
    effect = CATALOGUE["drum-eccentricity"]
    coordinates = Coordinates(effect)
    size, phase = effect.polar or ("", "")
    typical = effect.parameter(size).typical
    at = coordinates.vector({size: 2 * typical, phase: np.pi / 6})
    assert at == pytest.approx([2 * np.cos(np.pi / 6), 1.0])
    assert coordinates.n_parameters == len(coordinates) == 2


def test_an_order_is_scanned_and_costs_a_degree_of_freedom() -> None:
    effect = CATALOGUE["motor-cogging"]
    coordinates = Coordinates(effect)
    whole = [p for p in effect.parameters if p.whole]
    assert len(whole) == 1
    assert coordinates.n_parameters == len(coordinates) + 1
    assert [point[whole[0].name] for point in coordinates.grid()] == list(whole[0].grid)
