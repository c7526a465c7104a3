"""The online estimator against the simulator's integration, an ODE solver and itself perturbed."""

from __future__ import annotations

import sys
from dataclasses import replace
from itertools import pairwise
from math import cos, isnan, pi, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from command_line import own_process
from estimation_plant import WRAPS, cell_readings, wander
from winchkit.errors import UsageError
from winchkit.estimation import PLAIN, DahlEstimator, Kernels, PulleyGroup, compiled, fastest
from winchkit.estimation.dahl_batch import dahl_batch
from winchkit.model.friction import dahl, dahl_constant, dahl_step

EXACT = ((0.0,) * 3,) * 3
GROUP = PulleyGroup(WRAPS, friction=0.02, stiffness=1500.0, covariance=EXACT)
moves = st.lists(st.floats(-0.02, 0.02), min_size=1, max_size=40)
shapes = st.sampled_from([0.5, 1.0, 1.3, 2.0])


def estimates(estimator: DahlEstimator, cell: np.ndarray, wound: np.ndarray) -> np.ndarray:
    return np.array([estimator.update(t, x) for t, x in zip(cell, wound, strict=True)])


@pytest.mark.parametrize("shape", [0.7, 1.0, 1.5, 2.0])
def test_it_finds_the_platform_of_an_independent_plant(shape: float) -> None:
    _, platform, wound = wander()
    cell = cell_readings(platform, wound, shape=shape)
    found = estimates(DahlEstimator([replace(GROUP, shape=shape)]), cell, wound)[:, 0]
    assert np.std(cell - platform) > 10
    assert np.max(np.abs(found - platform)) < 0.05


@pytest.mark.parametrize("shape", [1.0, 1.6])
def test_one_pulley_follows_the_differential_equation(shape: float) -> None:
    """dF/dx = σ|1 − sF/F_c|^β sgn, F_c = μ N(T, T + F), at a constant tension at the cell."""
    tension, friction, stiffness, wrap = 400.0, 0.05, 2000.0, 2.0

    def rate(_: float, force: np.ndarray, sign: float) -> np.ndarray:
        after = tension + force
        normal = np.sqrt(tension**2 - 2 * tension * after * cos(wrap) + after**2)
        left = 1 - sign * force / (friction * normal)
        return sign * stiffness * np.abs(left) ** shape * np.sign(left)

    group = PulleyGroup((wrap,), friction, stiffness, shape)
    estimator, steps = DahlEstimator([group]), 400
    estimator.update(tension, 0.0)
    force, wound = 0.0, 0.0
    for sign, length in ((1.0, 0.03), (-1.0, 0.012), (1.0, 0.004), (-1.0, 0.05)):
        solved = solve_ivp(
            rate, (0, length), [force], args=(sign,), method="DOP853", rtol=1e-10, atol=1e-10
        )
        force = solved.y[0, -1]
        # The friction is positive towards the platform: paying out.
        for _ in range(steps):
            wound -= sign * length / steps
            found = estimator.update(tension, wound).value
        assert found == pytest.approx(tension + force, abs=2e-3 * friction * tension)


@given(moves, shapes)
def test_paying_out_is_the_mirror_of_winding_in_for_little_friction(
    steps: list[float], shape: float
) -> None:
    group = PulleyGroup((pi,), 1e-6, 0.1, shape)
    one, other = DahlEstimator([group]), DahlEstimator([group])
    for position in np.cumsum([0.0, *steps]):
        one.update(500.0, float(position))
        other.update(500.0, -float(position))
        # What they differ by is of the order of the friction itself, of the sliding force 1e-3 N.
        assert one.forces[0] == pytest.approx(-other.forces[0], rel=1e-4, abs=10 * 1e-6 * 1e-3)


@given(moves, shapes, st.floats(0.001, 0.2), st.floats(10, 5000))
def test_friction_stays_within_sliding(
    steps: list[float], shape: float, friction: float, tension: float
) -> None:
    estimator = DahlEstimator([PulleyGroup((pi,), friction, 3000.0, shape)])
    # Sliding towards the platform over half a turn: F = μ(2T + F).
    most = 2 * friction * tension / (1 - friction)
    for position in np.cumsum([0.0, *steps]):
        value, _ = estimator.update(tension, float(position))
        assert abs(value - tension) <= most * (1 + 1e-9)


@given(st.lists(st.floats(0.001, 0.02), min_size=2, max_size=8), shapes)
def test_a_closed_loop_costs_energy(sizes: list[float], shape: float) -> None:
    estimator = DahlEstimator([PulleyGroup((pi,), 0.03, 1500.0, shape)])
    tension, position, work = 300.0, 0.0, 0.0
    estimator.update(tension, position)
    path = [0.0]
    for size in sizes:
        path += [size, -size]
    path = [*path, 0.0, *path, 0.0]
    for target in path:
        for there in np.linspace(position, target, 30)[1:]:
            before = sum(estimator.forces)
            estimator.update(tension, float(there))
            # Friction is counted along paying out, the cable's way is minus what is wound in.
            work += (before + sum(estimator.forces)) / 2 * (position - float(there))
            position = float(there)
    assert work > 0


@pytest.mark.parametrize("shape", [0.7, 1.0, 1.00001, 1.4, 2.0])
@pytest.mark.parametrize("name", ["friction", "stiffness", "shape"])
def test_the_std_is_that_of_a_perturbed_parameter(name: str, shape: float) -> None:
    group = PulleyGroup((pi, pi / 2), 0.01, 800.0, shape, EXACT)
    index = ("friction", "stiffness", "shape").index(name)
    step = 1e-4 * getattr(group, name)
    covariance = np.zeros((3, 3))
    covariance[index, index] = step**2
    _, platform, wound = wander(12.0)
    told = DahlEstimator([replace(group, covariance=tuple(map(tuple, covariance)))])
    known = estimates(DahlEstimator([group]), platform, wound)[:, 1]
    found = np.sqrt(estimates(told, platform, wound)[:, 1] ** 2 - known**2)
    more, less = (
        estimates(
            DahlEstimator([replace(group, **{name: getattr(group, name) + d})]), platform, wound
        )
        for d in (step, -step)
    )
    central = np.abs(more - less)[:, 0] / 2
    # The dependence of the limit on the friction itself, of order μ, is left out.
    assert np.allclose(found[300:], central[300:], rtol=0.03, atol=0.02 * central[300:].max())


@pytest.mark.slow
def test_the_std_holds_what_parameters_drawn_at_random_do() -> None:
    rng = np.random.default_rng(3)
    covariance = np.diag([1e-3, 100.0, 0.05]) ** 2
    covariance[0, 1] = covariance[1, 0] = 0.6 * 1e-3 * 100.0
    group = PulleyGroup(WRAPS, 0.02, 1500.0, 1.2, tuple(map(tuple, covariance)))
    _, platform, wound = wander(10.0)
    std = estimates(DahlEstimator([group]), platform, wound)[:, 1]
    drawn = rng.multivariate_normal([0.02, 1500.0, 1.2], covariance, 150)
    spread = np.std(
        [estimates(DahlEstimator([PulleyGroup(WRAPS, *d)]), platform, wound)[:, 0] for d in drawn],
        axis=0,
    )
    later = slice(150, None)
    assert np.median(std[later] / spread[later]) == pytest.approx(1.0, abs=0.15)


def test_parameters_without_a_declared_std_leave_the_std_unknown() -> None:
    estimator = DahlEstimator([replace(GROUP, covariance=PulleyGroup(WRAPS, 0.02, 1.0).covariance)])
    value, std = estimator.update(300.0, 0.0)
    assert value == 300.0
    assert isnan(std)


@pytest.mark.slow
def test_two_stds_hold_the_error_of_friction_and_stiffness_that_are_off() -> None:
    """Friction 10 % and stiffness 30 % off, one standard deviation each, as declared."""
    random = np.random.default_rng(5)
    covariance = tuple(map(tuple, np.diag([0.1 * 0.02, 0.3 * 1500.0, 0.0]) ** 2))
    _, platform, wound = wander(20.0)
    cell = cell_readings(platform, wound, shape=1.0)
    held, exact, ratios = [], [], []
    for mu, sigma in 1.0 + random.standard_normal((20, 2)) * [0.1, 0.3]:
        group = replace(GROUP, friction=0.02 * mu, stiffness=1500.0 * max(0.1, sigma))
        found = estimates(DahlEstimator([replace(group, covariance=covariance)]), cell, wound)
        error, std = np.abs(found[:, 0] - platform)[300:], found[300:, 1]
        held.append(np.mean(error <= 2.0 * std))
        ratios.append(np.mean(error**2) / np.mean(std**2))
        exact.append(
            np.mean(error <= 2.0 * estimates(DahlEstimator([group]), cell, wound)[300:, 1])
        )
    assert np.mean(held) >= 0.95
    assert 0.7 <= np.sqrt(np.mean(ratios)) <= 1.2
    assert np.mean(exact) < 0.2, "taken as exact it is far too small"


def test_an_unknown_start_is_reported_until_the_cable_has_moved() -> None:
    estimator = DahlEstimator([GROUP], cell_std=0.5)
    first = estimator.update(300.0, 0.0)
    # Anything from −F_c to F_c: a rectangle of that width over each pulley, all alike.
    limit = sum(0.02 * 300.0 * 2 * np.sin(wrap / 2) for wrap in WRAPS)
    assert first.value == 300.0
    assert first.std == pytest.approx(sqrt(limit**2 / 3 + 0.25), rel=1e-9)
    stds = [estimator.update(300.0, 0.001 * k).std for k in range(1, 101)]
    assert all(later <= earlier for earlier, later in pairwise(stds))
    assert stds[-1] == pytest.approx(0.5, rel=1e-6)


def test_the_floor_is_cell_and_model() -> None:
    estimator = DahlEstimator([replace(GROUP, friction=0.0)], cell_std=3.0, model_std=4.0)
    assert estimator.update(100.0, 0.0) == (100.0, 5.0)
    assert estimator.update(90.0, 0.1) == (90.0, 5.0)


def test_a_gap_is_nan_and_its_motion_counts_afterwards() -> None:
    whole, gapped = DahlEstimator([GROUP]), DahlEstimator([GROUP])
    for position in (0.0, 0.002, 0.004, 0.006):
        expected = whole.update(300.0, position)
    for tension, position in ((300.0, 0.0), (float("nan"), 0.002), (300.0, float("nan"))):
        found = gapped.update(tension, position)
    assert isnan(found.value)
    assert isnan(found.std)
    found = gapped.update(300.0, 0.006)
    assert found.value == pytest.approx(expected.value, rel=1e-4)
    assert found.std == pytest.approx(expected.std, rel=0.05)


def test_a_trembling_encoder_is_no_motion_within_the_dead_band() -> None:
    rng = np.random.default_rng(0)
    steady, forgetful = DahlEstimator([GROUP], dead_band=1e-4), DahlEstimator([GROUP])
    for estimator in (steady, forgetful):
        estimator.update(300.0, 0.0)
        estimator.update(300.0, 0.004)
    before = steady.forces
    for tremble in rng.uniform(-9e-5, 9e-5, 4000):
        steady.update(300.0, 0.004 + float(tremble))
        forgetful.update(300.0, 0.004 + float(tremble))
    assert steady.forces == before
    # Without it Dahl friction dithers away: the reason for the dead band.
    assert abs(sum(forgetful.forces)) < 0.5 * abs(sum(before))
    slow = DahlEstimator([GROUP], dead_band=1e-4)
    for k in range(2000):
        slow.update(300.0, 1e-5 * k)
    free = DahlEstimator([GROUP])
    free.update(300.0, 0.0)
    free.update(300.0, 1e-5 * 1999)
    assert sum(slow.forces) == pytest.approx(sum(free.forces), rel=0.01)


def test_reset_forgets() -> None:
    estimator = DahlEstimator([GROUP])
    first = estimator.update(300.0, 5.0)
    estimator.update(300.0, 5.1)
    estimator.reset()
    assert estimator.forces == (0.0, 0.0, 0.0)
    assert estimator.update(300.0, -2.0) == first


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"friction": 1.0}, "friction"),
        ({"friction": -0.1}, "friction"),
        ({"stiffness": float("nan")}, "stiffness"),
        ({"shape": -1.0}, "shape"),
        ({"wraps": ()}, "wraps"),
        ({"wraps": (float("inf"),)}, "wraps"),
    ],
)
def test_numbers_that_no_pulley_has_are_refused(change: dict[str, object], said: str) -> None:
    with pytest.raises(UsageError, match=said):
        DahlEstimator([replace(GROUP, **change)])  # type: ignore[arg-type]


def test_no_group_and_negative_noise_are_refused() -> None:
    with pytest.raises(UsageError, match="at least one pulley group"):
        DahlEstimator([])
    with pytest.raises(UsageError, match="cell_std"):
        DahlEstimator([GROUP], cell_std=-1.0)
    with pytest.raises(UsageError, match="dead_band"):
        DahlEstimator([GROUP], dead_band=float("nan"))


def test_without_numba_the_reason_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numba", None)
    with pytest.raises(UsageError, match=r"winchkit\[fast\]"):
        compiled()


def test_fastest_is_what_is_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert fastest() is PLAIN


def test_compiled_and_plain_loops_agree(compiled_kernels: Kernels) -> None:
    covariance = tuple(map(tuple, np.diag([1e-6, 1e4, 1e-2])))
    groups = [GROUP, PulleyGroup((1.0,), 0.05, 300.0, 1.4, covariance)]
    _, platform, wound = wander(10.0)
    rows = [
        estimates(DahlEstimator(groups, kernels=each), platform, wound)
        for each in (PLAIN, compiled_kernels)
    ]
    assert np.allclose(*rows, rtol=1e-12, atol=1e-9)


def test_nothing_heavy_comes_with_the_import() -> None:
    code = "import sys, winchkit.estimation; print({'scipy', 'numba'} & set(sys.modules))"
    done = own_process(sys.executable, "-c", code)
    assert done.stdout.strip() == "set()"


@settings(max_examples=30)
@given(moves)
def test_groups_in_a_row_are_one_group(steps: list[float]) -> None:
    apart = DahlEstimator([replace(GROUP, wraps=(wrap,)) for wrap in WRAPS])
    together = DahlEstimator([GROUP])
    for position in np.cumsum([0.0, *steps]):
        found = apart.update(200.0, float(position))
        assert found.value == pytest.approx(together.update(200.0, float(position)).value)


all_shapes = st.sampled_from([0.0, 0.5, 1.0, 1.3, 2.0])
steps = st.lists(st.one_of(st.just(0.0), st.floats(-0.03, 0.03)), max_size=60)


@given(steps, all_shapes, st.floats(-1, 1))
def test_pieces_are_step_after_step(moves: list[float], shape: float, start: float) -> None:
    position = np.cumsum([0.0, *moves])
    force, expected = start * 20.0, [start * 20.0]
    for before, after in pairwise(position):
        force = dahl_step(force, float(after - before), 20.0, 3000.0, shape)
        expected.append(force)
    found = dahl_constant(position, 20.0, 3000.0, shape, start)
    # Near the limit and below β = 1 a rounding of the force moves what is left by its root.
    assert np.allclose(found, expected, rtol=1e-6, atol=1e-5)


@pytest.mark.parametrize("shape", [0.5, 1.0, 1.3])
def test_the_ways_agree_on_a_long_recording(shape: float) -> None:
    rng = np.random.default_rng(1)
    smooth = 0.05 * np.sin(np.linspace(0, 60, 20_000))
    rough = smooth + rng.normal(0, 1e-4, len(smooth))
    for position in (smooth, rough):
        pieces = dahl_constant(position, 20.0, 3000.0, shape, 0.3)
        stepped = dahl(position, np.full(len(position), 20.0), 3000.0, shape, 0.3)
        assert np.allclose(pieces, stepped, atol=1e-6)
        assert np.allclose(dahl_batch(position, 20.0, 3000.0, shape, 0.3), pieces, atol=1e-6)


def test_a_limit_that_changes_is_followed() -> None:
    position = 0.05 * np.sin(np.linspace(0, 30, 2000))
    limit = 20 + 5 * np.cos(np.linspace(0, 11, 2000))
    for shape in (1.0, 1.4):
        force, expected = 0.0, []
        for moved, most in zip(np.diff(position, prepend=position[0]), limit, strict=True):
            force = dahl_step(force, float(moved), float(most), 3000.0, shape)
            expected.append(force)
        assert np.allclose(dahl_batch(position, limit, 3000.0, shape), expected, atol=1e-9)


@pytest.mark.slow
def test_compiled_loops_agree(compiled_kernels: Kernels) -> None:
    rng = np.random.default_rng(1)
    position = np.cumsum(rng.normal(0, 1e-3, 3000))
    limit = 20 + 5 * np.cos(np.linspace(0, 11, 3000))
    for shape in (0.5, 1.0, 1.4):
        for most in (limit, 20.0):
            plain = dahl_batch(position, most, 3000.0, shape, 0.2)
            fast = dahl_batch(position, most, 3000.0, shape, 0.2, kernels=compiled_kernels)
            assert np.allclose(fast, plain, rtol=1e-6, atol=1e-6)


def test_nothing_and_no_limit() -> None:
    assert dahl_batch([], 20.0, 3000.0).shape == (0,)
    assert dahl_batch([1.0], 20.0, 3000.0, start=0.5).tolist() == [10.0]
    assert np.array_equal(dahl_batch(np.arange(5.0), 0.0, 3000.0), np.zeros(5))
    assert np.array_equal(dahl_batch(np.ones(5), 20.0, 3000.0, start=-1.0), np.full(5, -20.0))


@pytest.mark.parametrize(
    ("position", "limit"), [(np.ones((2, 2)), 1.0), (np.ones(3), np.ones(4)), (1.0, 1.0)]
)
def test_shapes_that_do_not_fit_are_refused(position: object, limit: object) -> None:
    with pytest.raises(UsageError, match="shape"):
        dahl_batch(position, limit, 1.0)  # type: ignore[arg-type]
