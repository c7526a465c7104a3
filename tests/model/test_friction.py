"""Pulley friction against the implicit equations and an ODE solver."""

from __future__ import annotations

from math import cos, pi

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from winchkit.model.friction import coulomb_ratio, dahl, dahl_step, normal_force

frictions = st.floats(-0.6, 0.6)
wraps = st.floats(0.0, pi)
shapes = st.sampled_from([0.0, 0.5, 1.0, 1.5, 2.0, 3.0])
limits = st.floats(0.1, 100.0)


@given(frictions, wraps)
def test_coulomb_ratio_solves_the_implicit_equation(friction: float, wrap: float) -> None:
    """T1 − T0 = μ √(T0² − 2 T0 T1 cos α + T1²), Eq. 20–22, by a bracketing solver."""

    def missing(ratio: float) -> float:
        return ratio - 1 - friction * np.sqrt(1 - 2 * ratio * cos(wrap) + ratio**2)

    assume(wrap > 0.01)
    expected = brentq(missing, 0.0, 1e3, xtol=1e-15, rtol=1e-14)
    assert float(coulomb_ratio(np.asarray(friction), wrap)) == pytest.approx(expected, rel=1e-9)


@given(frictions, wraps)
def test_the_other_way_round_is_the_inverse(friction: float, wrap: float) -> None:
    there, back = (coulomb_ratio(np.asarray(sign * friction), wrap) for sign in (1, -1))
    assert float(there * back) == pytest.approx(1.0, rel=1e-12)


@given(wraps)
def test_without_friction_or_wrap_the_tension_stays(wrap: float) -> None:
    assert float(coulomb_ratio(np.asarray(0.0), wrap)) == 1.0
    assert float(coulomb_ratio(np.asarray(0.3), 0.0)) == pytest.approx(1.0, rel=1e-14)


@given(st.floats(-1e-4, 1e-4), wraps)
def test_small_friction_is_linear(friction: float, wrap: float) -> None:
    slope = np.sqrt(2 * (1 - cos(wrap)))
    found = float(coulomb_ratio(np.asarray(friction), wrap)) - 1
    assert found == pytest.approx(friction * slope, abs=3 * friction**2 + 1e-15)


def test_normal_force_of_plain_wraps() -> None:
    first, second = np.array([100.0, 30.0]), np.array([120.0, 40.0])
    assert np.allclose(normal_force(first, second, pi), first + second)
    assert np.allclose(normal_force(first, second, pi / 2), np.hypot(first, second))
    assert np.allclose(normal_force(first, second, 0.0), np.abs(first - second))


@pytest.mark.parametrize("shape", [0.3, 0.5, 1.0, 1.5, 2.0, 3.0])
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("share", [-1.0, -0.4, 0.0, 0.7])
def test_dahl_step_follows_its_differential_equation(shape: float, sign: int, share: float) -> None:
    limit, stiffness = 20.0, 3000.0
    start = sign * share * limit
    # Below β = 1 the limit is reached within a finite distance; stay short of it.
    left = 1 - share
    reach = left ** (1 - shape) / (1 - shape) if shape < 1 else 2.0
    moved = sign * 0.8 * reach * limit / stiffness

    def rate(_: float, force: np.ndarray) -> np.ndarray:
        rest = 1 - sign * force / limit
        return stiffness * np.abs(rest) ** shape * np.sign(rest)

    solved = solve_ivp(rate, (0, moved), [start], method="DOP853", rtol=1e-12, atol=1e-12)
    found = dahl_step(start, moved, limit, stiffness, shape)
    assert found == pytest.approx(solved.y[0, -1], abs=1e-9)


@given(shapes, limits, st.floats(-1, 1), st.floats(-0.05, 0.05), st.floats(0, 1))
def test_one_long_step_is_two_short_ones(
    shape: float, limit: float, share: float, moved: float, part: float
) -> None:
    whole = dahl_step(share * limit, moved, limit, 1000.0, shape)
    half_way = dahl_step(share * limit, part * moved, limit, 1000.0, shape)
    twice = dahl_step(half_way, (1 - part) * moved, limit, 1000.0, shape)
    # Near the limit and below β = 1 a rounding of the force moves what is left by its root.
    assert twice == pytest.approx(whole, rel=1e-6, abs=1e-6 * limit)


@given(shapes, limits, st.floats(-1, 1), st.floats(-1, 1))
def test_friction_never_passes_its_limit(
    shape: float, limit: float, share: float, moved: float
) -> None:
    found = dahl_step(share * limit, moved, limit, 1000.0, shape)
    assert abs(found) <= limit * (1 + 1e-12)
    if moved:
        assert np.sign(moved) * (found - share * limit) >= -1e-9 * limit


def test_below_one_the_limit_is_reached_after_a_finite_distance() -> None:
    # β = 0: F grows by σ per length and stops at F_c.
    assert dahl_step(0.0, 0.005, 10.0, 1000.0, 0.0) == pytest.approx(5.0, rel=1e-12)
    assert dahl_step(0.0, 0.02, 10.0, 1000.0, 0.0) == 10.0


@pytest.mark.parametrize("shape", [0.5, 1.0, 2.0])
def test_dahl_along_a_path_is_step_after_step(shape: float) -> None:
    rng = np.random.default_rng(4)
    position = np.cumsum(rng.normal(0, 2e-3, 500))
    limit = 20 + 5 * np.sin(np.arange(500) / 30)
    found = dahl(position, limit, 3000.0, shape, start=0.5)
    force, expected = 0.5 * limit[0], []
    for k in range(500):
        moved = position[k] - position[max(k - 1, 0)]
        force = dahl_step(force, moved, limit[k], 3000.0, shape)
        expected.append(force)
    assert np.allclose(found, expected, rtol=1e-9, atol=1e-9)


def test_dahl_does_not_depend_on_the_sampling() -> None:
    fine = 0.01 * np.sin(np.linspace(0, 12, 12001))
    limit = np.full(12001, 15.0)
    every = dahl(fine, limit, 4000.0)
    turning = np.flatnonzero(np.diff(np.sign(np.diff(fine)))) + 1
    kept = np.unique(np.concatenate([[0], turning, np.arange(0, 12001, 400)]))
    few = dahl(fine[kept], limit[kept], 4000.0)
    assert np.allclose(few, every[kept], atol=1e-9)


def test_dahl_without_a_limit_is_nothing() -> None:
    position = np.linspace(0, 1, 20)
    for shape in (1.0, 2.0):
        assert np.array_equal(dahl(position, np.zeros(20), 1e3, shape), np.zeros(20))
