"""Cable forces against scipy's optimisers, and where one freedom is left against its interval."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import LinearConstraint, minimize

from robot_cases import near, random_geometry, shipped
from winchkit.errors import UsageError
from winchkit.model.rotation import rotation_by
from winchkit.robot import (
    ForceLimits,
    Pose,
    closed_form,
    distributed_forces,
    gravity_wrench,
    improved_closed_form,
    quadratic,
    steepest_force,
    structure_matrix,
    wrench_feasibility,
)
from winchkit.schema.profiles.robot import PlatformSpec
from winchkit.units import GRAVITY

Array = np.ndarray
seeds = st.integers(0, 10_000)
LIMITS = ForceLimits(20.0, 1000.0)
METHODS = (closed_form, improved_closed_form, quadratic)


def matrix_of(seed: int, lines: int = 8) -> Array:
    geometry = random_geometry(seed, lines)
    return structure_matrix(geometry, np.zeros((1, 3)), np.eye(3)[None])[0]


def cases(seed: int) -> tuple[Array, Array]:
    """A robot of the papers somewhere, and a wrench on it."""
    rng = np.random.default_rng(seed)
    robot = shipped(("cabtive", "ipanema3")[seed % 2])
    structure = robot.structure(near(robot, seed, 1, 0.2, 0.05))[0]
    size = np.array([1.0, 1.0, 1.0, 0.05, 0.05, 0.05])
    return structure, rng.normal(size=6) * size * rng.choice([10.0, 200.0, 700.0])


@settings(max_examples=40, deadline=None)
@given(seeds)
def test_every_method_balances_the_wrench_within_the_limits(seed: int) -> None:
    structure, wrench = cases(seed)
    for method in METHODS:
        found = method(structure, wrench, LIMITS)
        if found.feasible:
            np.testing.assert_allclose(structure @ found.value, -wrench, atol=1e-6)
            assert found.value.min() >= 20.0 - 1e-5
            assert found.value.max() <= 1000.0 + 1e-5


@settings(max_examples=40, deadline=None)
@given(seeds)
def test_each_method_finds_all_that_the_one_before_it_finds(seed: int) -> None:
    structure, wrench = cases(seed)
    closed, improved, best = (method(structure, wrench, LIMITS) for method in METHODS)
    assert closed.feasible <= improved.feasible <= best.feasible
    assert best.feasible == wrench_feasibility(structure, wrench, LIMITS).feasible
    middle = 510.0
    if closed.feasible:
        np.testing.assert_allclose(best.value, closed.value, atol=1e-7)
    elif improved.feasible:
        there = np.linalg.norm(improved.value - middle)
        assert np.linalg.norm(best.value - middle) <= there + 1e-6


def test_the_methods_differ_where_they_should() -> None:
    found = {
        tuple(method(*cases(seed), LIMITS).feasible for method in METHODS) for seed in range(300)
    }
    assert {(True, True, True), (False, True, True), (False, False, False)} <= found


def at_limits() -> list[int]:
    """Cases in which the best forces touch their limits."""
    found = [
        seed
        for seed in range(200)
        if quadratic(*cases(seed), LIMITS).feasible
        and not closed_form(*cases(seed), LIMITS).feasible
    ]
    return found[:12]


def test_quadratic_is_scipys_optimum() -> None:
    assert len(at_limits()) == 12
    for seed in at_limits():
        compare_with_slsqp(*cases(seed))


def compare_with_slsqp(structure: Array, wrench: Array) -> None:
    found = quadratic(structure, wrench, LIMITS)
    theirs = optimum(structure, wrench, found.value + 1.0)
    distance = np.sum((theirs - 510.0) ** 2)
    assert np.sum((found.value - 510.0) ** 2) <= distance * (1 + 1e-6) + 1e-6
    np.testing.assert_allclose(found.value, theirs, atol=0.5)


def test_forces_of_many_poses_are_those_of_each_by_a_linear_programme_and_slsqp() -> None:
    """Rows whose closed form is within the limits, beyond them, without forces, and unknown."""
    seeds = [*range(0, 40, 2), *(seed for seed in at_limits() if seed % 2 == 0)]
    structure, wrench = (np.array(items) for items in zip(*map(cases, seeds), strict=True))
    structure[3] = np.nan
    found = distributed_forces(structure, wrench, LIMITS)
    assert np.isnan(found[3]).all()
    kinds = set()
    for k in set(range(len(seeds))) - {3}:
        exists = wrench_feasibility(structure[k], wrench[k], LIMITS).feasible
        assert np.isfinite(found[k]).all() == exists
        if exists:
            np.testing.assert_allclose(structure[k] @ found[k], -wrench[k], atol=1e-6)
            assert found[k].min() >= 20.0 - 1e-5
            assert found[k].max() <= 1000.0 + 1e-5
            best = np.linalg.norm(found[k] - 510.0)
            assert best <= np.linalg.norm(optimum(structure[k], wrench[k], 510.0) - 510.0) + 1e-3
        kinds.add((exists, closed_form(structure[k], wrench[k], LIMITS).feasible))
    assert kinds == {(True, True), (True, False), (False, False)}


def optimum(structure: Array, wrench: Array, start: Array | float) -> Array:
    """Forces nearest to the middle of the limits by SLSQP."""
    found = minimize(
        lambda f: np.sum((f - 510.0) ** 2) / 1e5,
        np.full(8, start),
        jac=lambda f: 2 * (f - 510.0) / 1e5,
        method="SLSQP",
        bounds=[(20.0, 1000.0)] * 8,
        constraints=LinearConstraint(structure, -wrench, -wrench),
        options={"ftol": 1e-14, "maxiter": 1000},
    )
    assert np.abs(structure @ found.x + wrench).max() < 1e-4
    return np.asarray(found.x)


@settings(max_examples=40, deadline=None)
@given(seeds)
def test_with_seven_cables_the_margin_is_that_of_an_interval(seed: int) -> None:
    """One freedom is left: f = f_0 + t n, and the best t lies where two limits are equally far."""
    structure = matrix_of(seed, 7)
    assume(np.linalg.cond(structure) < 100)
    wrench = np.random.default_rng(seed).normal(size=6) * 50
    start = -np.linalg.pinv(structure) @ wrench
    direction = np.linalg.svd(structure)[2][6]

    def margin(t: float) -> float:
        force = start + t * direction
        return float(min(np.min(force - 20.0), np.min(1000.0 - force)))

    # Concave and made of straight pieces: the best is where two of them cross.
    slopes = np.concatenate([direction, -direction])
    offsets = np.concatenate([start - 20.0, 1000.0 - start])
    rise = slopes[:, None] - slopes
    crossings = (offsets - offsets[:, None])[rise != 0] / rise[rise != 0]
    best = max(margin(t) for t in crossings)
    found = wrench_feasibility(structure, wrench, LIMITS)
    assert found.margin == pytest.approx(best, abs=1e-5)
    assert found.feasible == (best >= -1e-6)


def test_limits_may_differ_from_line_to_line_and_be_infinite() -> None:
    robot = shipped("cabtive")
    structure, weight = robot.structure(robot.home)[0], robot.weight(robot.home)[0]
    low, high = np.linspace(5, 40, 8), np.linspace(100, 400, 8)
    found = quadratic(structure, weight, ForceLimits(low, high))
    assert found.feasible
    assert np.all((found.value >= low - 1e-6) & (found.value <= high + 1e-6))
    assert wrench_feasibility(structure, weight, ForceLimits(0.0, np.inf)).feasible
    with pytest.raises(UsageError, match="must be finite"):
        quadratic(structure, weight, ForceLimits(0.0, np.inf))
    with pytest.raises(UsageError, match="not below"):
        closed_form(structure, weight, ForceLimits(10.0, 10.0))


def test_a_wrench_that_cables_from_above_cannot_hold() -> None:
    robot = shipped("winding-device-8")
    structure = robot.structure(robot.home)[0]
    lift = np.array([0, 0, 500.0, 0, 0, 0])
    found = wrench_feasibility(structure, lift, ForceLimits(0.0, np.inf))
    assert not found.feasible
    assert found.margin < 0
    assert not quadratic(structure, lift, LIMITS).feasible
    assert np.isnan(quadratic(structure, lift, LIMITS).value).all()


def test_a_wrench_beyond_the_matrix_has_no_margin_at_all() -> None:
    """All cables through one point: nothing takes a moment."""
    structure = matrix_of(0)
    structure[3:] = 0.0
    moment = np.array([0, 0, 0, 5.0, 0, 0])
    found = wrench_feasibility(structure, moment, LIMITS)
    assert not found.feasible
    assert np.isnan(found.margin)
    assert not closed_form(structure, moment, LIMITS).feasible


def test_weight_acts_in_the_centre_of_mass() -> None:
    platform = PlatformSpec(3.0, (0.1, 0.0, -0.2))
    rotation = rotation_by(np.array([[0.0, np.pi / 2, 0.0]]))
    found = gravity_wrench(platform, rotation)[0]
    lever = Pose(np.zeros((1, 3)), rotation).rotation[0] @ [0.1, 0.0, -0.2]
    np.testing.assert_allclose(found[:3], [0, 0, -3 * GRAVITY])
    np.testing.assert_allclose(found[3:], np.cross(lever, found[:3]), atol=1e-12)
    assert found[4] == pytest.approx(-0.2 * 3 * GRAVITY)


def test_the_steepest_force_is_per_length_of_path() -> None:
    distance = np.array([0.0, 0.1, 0.3, 0.4])
    force = np.array([[1.0, 5.0], [2.0, 5.0], [8.0, np.nan], [9.0, 4.0]])
    assert steepest_force(force, distance) == pytest.approx(30.0)
    assert np.isnan(steepest_force(force[:1], distance[:1]))
