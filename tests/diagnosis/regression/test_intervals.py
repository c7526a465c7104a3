"""Intervals of fitted values and their coverage."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.stats import t

from diagnosis_runs import GROOVED, Array, Ride, made, term, with_channel
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.regression.gls import Fit, fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.intervals import (
    between_parts,
    effective_dof,
    estimates,
    profile_ends,
    spread_of,
)
from winchkit.diagnosis.regression.noise import BandNoise, noise_from_repeats
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression

RIDE = Ride(samples=400)
GAIN = term("cell-gain", gain_error=0.01)
CASES = 150
REPEATS = 6


def white(random: np.random.Generator, count: int) -> Array:
    return np.asarray(random.standard_normal(count))


def coloured(random: np.random.Generator, count: int) -> Array:
    """First-order noise of the same size, correlated over ten samples."""
    out, state = np.empty(count), random.standard_normal()
    for index, kick in enumerate(random.standard_normal(count)):
        state = 0.9 * state + np.sqrt(1 - 0.9**2) * kick
        out[index] = state
    return out


@pytest.mark.slow
@pytest.mark.parametrize("kind", [pytest.param(white, marks=pytest.mark.campaign), coloured])
def test_intervals_cover_the_truth_in_95_of_100_cases(
    kind: Callable[[np.random.Generator, int], Array],
) -> None:
    """A linear toy: the gain of a cell, on repeats enough to know the noise."""
    # Recordings without noise are copies of each other, of which one is kept.
    runs = [made(seed, GROOVED, (GAIN,), {"tension": 0.8}, ride=RIDE) for seed in range(REPEATS)]
    regression = TimeSeriesRegression(prepare(runs, GROOVED))
    clean = regression.change(Hypothesis().with_term(GAIN, REPEATS))
    start = Hypothesis().with_term(term("cell-gain"), REPEATS)
    blocks = regression.blocks
    off, said = [], []
    for seed in range(CASES):
        random = np.random.default_rng(seed)
        regression.nominal_residual = clean + np.concatenate(
            [regression._masked(s, 0.8 * kind(random, s.band.count)) for s in regression.segments]
        )
        first = fit(regression, start, np.ones(regression.n_rows))
        noise = noise_from_repeats(regression, first.residual, np.zeros((regression.n_rows, 0)))
        found = fit(regression, start, noise.inverse_sigma(regression))
        spread = spread_of(regression, found, noise, blocks)
        ((_, values),) = estimates(regression, found, spread)
        off.append(values["gain_error"].value - 0.01)
        said.append(values["gain_error"].std)
    ratio = np.array(off) / np.array(said)
    # The larger of two estimates is on the safe side: from 95 % of 150, less three deviations.
    assert np.mean(np.abs(ratio) < 2) > 0.90
    # And no more than twice too wide.
    assert 0.5 < np.sqrt(np.mean(ratio**2)) < 1.2
    assert abs(np.mean(off)) < 4 * np.std(off) / np.sqrt(CASES)


def test_estimates_have_the_units_and_parameters_of_the_files() -> None:
    terms = (term("cable-elongation-linear", axial_stiffness=2e5), GAIN)
    runs = [
        made(int(mass) + seed, GROOVED, terms, load_mass=mass, ride=RIDE)
        for mass in (10.0, 25.0)
        for seed in range(2)
    ]
    regression = TimeSeriesRegression(prepare(runs, GROOVED))
    start = Hypothesis()
    for item in terms:
        start = start.with_term(item, 4)
    first = fit(regression, start, np.ones(regression.n_rows))
    noise = noise_from_repeats(regression, first.residual, np.zeros((regression.n_rows, 0)))
    found = fit(regression, start, noise.inverse_sigma(regression))
    spread = spread_of(regression, found, noise, regression.blocks)
    (rope, stretch), (cell, gain) = estimates(regression, found, spread)
    assert (rope.effect.id, cell.effect.id) == ("cable-elongation-linear", "cell-gain")
    stiffness = stretch["axial_stiffness"]
    assert (stiffness.unit, gain["gain_error"].unit) == ("N", "1")
    # A compliance of relative deviation s is a stiffness of the same.
    coordinate = regression.nuisance_columns.shape[1]
    assert stiffness.std / stiffness.value == pytest.approx(
        float(spread.std[coordinate] / found.vector[coordinate]), rel=0.01
    )
    assert abs(stiffness.value - 2e5) < 4 * stiffness.std
    assert abs(gain["gain_error"].value - 0.01) < 4 * gain["gain_error"].std


def _settled(regression: TimeSeriesRegression, start: Hypothesis) -> tuple[Fit, BandNoise]:
    first = fit(regression, start, np.ones(regression.n_rows))
    noise = noise_from_repeats(regression, first.residual, np.zeros((regression.n_rows, 0)))
    return fit(regression, start, noise.inverse_sigma(regression)), noise


def test_profile_ends_agree_with_full_refits() -> None:
    """Against scipy: least squares with the coordinate held, for a weak, nonlinear friction."""
    friction = term("motor-stribeck", torque=0.006, stribeck_speed=8.0)
    runs = [made(seed, GROOVED, (friction,), {"motor_torque": 6e-3}, ride=RIDE) for seed in (1, 2)]
    regression = TimeSeriesRegression(prepare(runs, GROOVED))
    found, noise = _settled(regression, Hypothesis().with_term(friction, 2))
    inverse_sigma = noise.inverse_sigma(regression)
    whitened = found.jacobian * inverse_sigma[:, None]
    covariance = np.linalg.inv(whitened.T @ whitened)
    low, high = profile_ends(
        regression, found, inverse_sigma, covariance, np.full(len(covariance), 1.96)
    )

    def risen(index: int, at: float) -> float:
        others = np.arange(len(found.vector)) != index

        def residual(free: Array) -> Array:
            vector = found.vector.copy()
            vector[index], vector[others] = at, free
            return (
                regression.residual(regression.hypothesis(vector, found.hypothesis)) * inverse_sigma
            )

        low, high = (bound[others] for bound in regression.bounds(found.hypothesis))
        start = np.clip(found.vector[others], low + 1e-6, high - 1e-6)
        best = least_squares(residual, start, x_scale="jac", bounds=(low, high))
        return 2 * float(best.cost) - found.chi_square

    first = regression.nuisance_columns.shape[1]
    for index in range(first, len(found.vector)):
        for end in (low[index], high[index]):
            assert risen(index, float(end)) == pytest.approx(1.96**2, rel=0.35)
    # The logarithm of the speed at which it fades is no parabola's: the two sides differ.
    speed = first + 1
    below, above = found.vector[speed] - low[speed], high[speed] - found.vector[speed]
    assert abs(below / above - 1) > 0.05


def test_contradicting_outputs_widen_an_interval() -> None:
    """The length says one radius, the torque another: the truth may be either."""
    one, other = term("drum-radius", radius_error=6e-4), term("drum-radius", radius_error=9e-4)
    runs = []
    for mass in (10.0, 25.0):
        for seed in range(2):
            run = made(int(mass) + seed, GROOVED, (one,), load_mass=mass, ride=RIDE)
            torque = made(int(mass) + seed, GROOVED, (other,), load_mass=mass, ride=RIDE)
            runs.append(with_channel(run, "motor_torque", torque["motor_torque"], "N m"))
    regression = TimeSeriesRegression(prepare(runs, GROOVED))
    start = Hypothesis().with_term(one, 4)
    found, noise = _settled(regression, start)
    blocks = regression.blocks
    ((_, told),) = estimates(regression, found, spread_of(regression, found, noise, blocks))
    low, high = told["radius_error"].interval or (np.nan, np.nan)
    assert low < 6e-4 < high
    # The same runs without the contradiction know it far better.
    whole = [
        made(int(mass) + seed, GROOVED, (one,), load_mass=mass, ride=RIDE)
        for mass in (10.0, 25.0)
        for seed in range(2)
    ]
    regression = TimeSeriesRegression(prepare(whole, GROOVED))
    found, noise = _settled(regression, start)
    ((_, sure),) = estimates(regression, found, spread_of(regression, found, noise, blocks))
    assert sure["radius_error"].std < 0.5 * told["radius_error"].std


def test_an_unidentifiable_parameter_is_undetermined_without_warning() -> None:
    """Which share of the torque is held within the play, where the length alone was recorded."""
    play = term("gear-backlash", gap=0.02, held=1.0)
    noise = {"cable_length": 3e-4}
    runs = [made(seed, GROOVED, (play,), noise, ride=RIDE) for seed in range(2)]
    regression = TimeSeriesRegression(prepare(runs, GROOVED))
    start = Hypothesis().with_term(play, 2)
    first = fit(regression, start, np.ones(regression.n_rows))
    known = noise_from_repeats(regression, first.residual, np.zeros((regression.n_rows, 0)))
    found = fit(regression, start, known.inverse_sigma(regression))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        spread = spread_of(regression, found, known, regression.blocks)
        ((_, values),) = estimates(regression, found, spread)
    assert np.isnan(values["held"].std)
    assert values["held"].interval is None
    low, high = values["gap"].interval or (np.nan, np.nan)
    assert low < 0.02 < high
    assert values["gap"].std < 0.01


def covered(parts: int, between: float, unequal: float = 0.0) -> tuple[float, float]:
    """Share of 20 000 intervals that hold the truth, and their mean length over the plain one.

    Every case has ``parts`` parts of weights e^N(0, ``unequal``) and values that differ by
    ``between`` standard deviations of a mean part.
    """
    random = np.random.default_rng(parts)
    weights = np.exp(unequal * random.standard_normal((parts, 20_000)))
    weights /= weights.sum(axis=0)
    whole = np.full(20_000, 1 / parts)
    own = random.standard_normal(weights.shape) * np.sqrt(whole / weights)
    values = own + between * random.standard_normal(weights.shape)
    common = np.sum(weights * values, axis=0)
    parted = between_parts(weights * (values - common), weights, whole)
    variance = whole + parted.variance
    half = t.ppf(0.975, effective_dof(variance, [parted])) * np.sqrt(variance)
    return float(np.mean(np.abs(common) < half)), float(np.mean(half / np.sqrt(whole)) / 1.96)


@pytest.mark.parametrize("parts", [2, 6, 20, 60])
def test_equal_parts_keep_the_level_without_a_long_interval(parts: int) -> None:
    share, length = covered(parts, 0.0)
    assert 0.945 < share < 0.975
    assert length < {2: 1.7, 6: 1.3, 20: 1.12, 60: 1.07}[parts]


@pytest.mark.parametrize("parts", [6, 20, 60])
@pytest.mark.parametrize("between", [1.0, 3.0, 20.0])
def test_parts_that_differ_keep_the_level(parts: int, between: float) -> None:
    assert covered(parts, between)[0] == pytest.approx(0.95, abs=0.01)


@pytest.mark.parametrize(("parts", "least"), [(6, 0.92), (20, 0.945), (60, 0.945)])
@pytest.mark.parametrize("between", [1.0, 3.0, 20.0])
def test_parts_of_unequal_weights_that_differ_keep_the_level(
    parts: int, least: float, between: float
) -> None:
    """Weights with a standard deviation of their logarithm of 1: six are three effective ones."""
    share, _ = covered(parts, between, 1.0)
    assert least < share < 0.98


def test_one_heavy_part_among_many_has_few_degrees_of_freedom() -> None:
    """Satterthwaite's formula against the moments of Q in 40 000 draws."""
    weights = np.array([[0.5], *[[0.5 / 9]] * 9])
    random = np.random.default_rng(4)
    between = 30.0
    values = random.standard_normal((10, 40_000)) * np.sqrt(1 / weights + between)
    shifts = weights * (values - np.sum(weights * values, axis=0))
    q = np.sum(shifts**2 / weights, axis=0)
    expected = 2 * np.mean(q) ** 2 / np.var(q)
    # Shifts whose Q is its expectation, so that the estimated variance is the true one.
    at = np.argmin(np.abs(q - np.mean(q)))
    parted = between_parts(shifts[:, [at]], weights, np.ones(1))
    assert parted.dof[0] == pytest.approx(expected, rel=0.05)
    assert parted.dof[0] < 7.0


def test_two_parts_that_differ_have_one_degree_of_freedom() -> None:
    """No interval of two values has both the level and a useful length; methods.md states it."""
    assert 0.80 < covered(2, 3.0)[0] < 0.95
    assert covered(2, 100.0)[0] == pytest.approx(0.95, abs=0.02)


def test_a_part_with_little_information_widens_an_interval_by_its_contradiction_only() -> None:
    """Sixty parts, one with a thousandth of the information and two deviations off."""
    weights = np.full((60, 1), (1 - 1e-3) / 59)
    weights[-1] = 1e-3
    values = np.zeros((60, 1))
    values[-1] = 2 / np.sqrt(1e-3)
    shifts = weights * (values - np.sum(weights * values, axis=0))
    assert between_parts(shifts, weights, np.ones(1)).variance == pytest.approx(0.0)
    both = np.array([[0.999], [0.001]])
    shifts = np.array([[0.999], [0.001]]) * np.array([[-0.001], [0.999]]) * 3 / np.sqrt(1e-3)
    # Birge: Q is 9, and the variance with it.
    assert between_parts(shifts, both, np.ones(1)).variance == pytest.approx(8.0, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("runs", "between"),
    [
        pytest.param(
            runs, between,
            marks=() if (runs, between) in {(2, 3.0), (6, 3.0)} else pytest.mark.campaign,
        )
        for between in (0.0, 3.0)
        for runs in (2, 6, 20, 60)
    ],
)  # fmt: skip
def test_intervals_of_many_programmes_cover_the_truth(runs: int, between: float) -> None:
    """The gain of a cell, each run another programme, the gain the same or another in each."""
    ride = Ride(samples=100, rate=10.0)
    recorded = [
        made(
            i, GROOVED, (), {"tension": 0.0}, ride=replace(ride, stroke=100.0 * 1.1 ** (i % 30)),
            load_mass=10.0 + i // 30, encoder=0.0,
        )
        for i in range(runs)
    ]  # fmt: skip
    regression = TimeSeriesRegression(prepare(recorded, GROOVED))
    assert len(set(regression.group_of_run)) == runs
    start = Hypothesis().with_term(term("cell-gain"), runs)
    column = regression.change(Hypothesis().with_term(GAIN, runs)) / 0.01
    power = np.full(len(regression.bands), 0.8**2)
    noise = BandNoise(power, np.full(len(power), 1e6), {"tension": 0.8}, from_repeats=True)
    one = 0.8 / np.sqrt(float(column @ column) / runs)
    inside, cases = 0, 200 if runs < 60 else 60
    for seed in range(cases):
        random = np.random.default_rng(seed)
        residual = 0.8 * random.standard_normal(regression.n_rows)
        for segment in regression.segments:
            residual[segment.rows] += column[segment.rows] * between * one * random.normal()
        regression.nominal_residual = residual
        found = fit(regression, start, noise.inverse_sigma(regression))
        spread = spread_of(regression, found, noise, regression.blocks)
        ((_, values),) = estimates(regression, found, spread)
        low, high = values["gain_error"].interval or (np.nan, np.nan)
        inside += low < 0.0 < high
    # Two of which differ have one degree of freedom between them.
    least = 0.78 if runs == 2 and between else 0.95 - 3 * np.sqrt(0.95 * 0.05 / cases)
    assert inside / cases > least
