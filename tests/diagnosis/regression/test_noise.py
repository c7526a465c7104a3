"""Noise variance from repeats, and the lack-of-fit test."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.fft import dct
from scipy.stats import kstest

from diagnosis_runs import GROOVED, NOISE, Array, Ride, length_problem, made, term
from winchkit import diagnose
from winchkit.diagnosis.regression.gls import Fit, fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.lack_of_fit import LackOfFitTest, lack_of_fit_test
from winchkit.diagnosis.regression.noise import BandNoise, noise_from_repeats, noise_saturated
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression

RIDE = Ride(samples=300)
SIZE = 3e-4
CASES = 200
NOTHING = [np.zeros(RIDE.samples), np.full(RIDE.samples, 1e-12)]


def white(random: np.random.Generator, count: int) -> Array:
    return SIZE * random.standard_normal(count)


def coloured(random: np.random.Generator, count: int, pole: float = 0.9) -> Array:
    """First-order noise, started in its steady state."""
    out = np.empty(count)
    out[0] = random.standard_normal() / np.sqrt(1 - pole**2)
    for index, kick in enumerate(random.standard_normal(count - 1), start=1):
        out[index] = pole * out[index - 1] + kick
    return SIZE * out


def fitted(regression: TimeSeriesRegression) -> Fit:
    return fit(regression, Hypothesis(), np.full(regression.n_rows, 1 / SIZE))


def estimated(regression: TimeSeriesRegression, known: Array | None = None) -> BandNoise:
    none = np.zeros((regression.n_rows, 0))
    return noise_from_repeats(
        regression, fitted(regression).residual, none if known is None else known
    )


def judged(regression: TimeSeriesRegression) -> tuple[LackOfFitTest, BandNoise]:
    found = fitted(regression)
    none = np.zeros((regression.n_rows, 0))
    noise = noise_from_repeats(regression, found.residual, none)
    return lack_of_fit_test(regression, found.residual, found.jacobian, noise), noise


def power_in_bands(regression: TimeSeriesRegression, of_row: Array) -> Array:
    """Mean of a spectrum's rows in every noise band."""
    rows = regression.band_of_row
    return np.asarray(np.bincount(rows, of_row) / np.bincount(rows))


def test_white_noise_is_recovered_in_every_band() -> None:
    random, ride = np.random.default_rng(1), Ride(samples=4000)
    regression = length_problem([white(random, 4000) for _ in range(4)], ride)
    noise = estimated(regression)
    assert noise.from_repeats
    assert noise.dof.sum() > 0.9 * 3 * 4000
    assert noise.rms["cable_length"] == pytest.approx(SIZE, rel=0.03)
    off = (noise.power / SIZE**2 - 1) / np.sqrt(2 / noise.dof)
    assert np.all(np.abs(off) < 4.0)


def test_coloured_noise_is_recovered_in_every_band() -> None:
    """Against the spectrum of a first-order process, σ²/|1 − a e^{−iω}|²."""
    random, pole, count = np.random.default_rng(2), 0.9, 4000
    regression = length_problem(
        [coloured(random, count, pole) for _ in range(5)], Ride(samples=count)
    )
    noise = estimated(regression)
    omega = np.pi * np.arange(count) / count
    spectrum = SIZE**2 / (1 - 2 * pole * np.cos(omega) + pole**2)
    expected = power_in_bands(regression, np.tile(spectrum, regression.n_runs))
    off = (noise.power / expected - 1) / np.sqrt(2 / noise.dof)
    assert np.all(np.abs(off) < 4.0)
    assert noise.power.max() > 50 * noise.power.min()
    assert noise.rms["cable_length"] == pytest.approx(SIZE / np.sqrt(1 - pole**2), rel=0.1)


def measured_anew(regression: TimeSeriesRegression, residuals: Sequence[Array]) -> None:
    """Put other residuals into a problem of one output: all else of its runs stays the same."""
    regression.nominal_residual = np.concatenate(
        [
            regression._masked(segment, residual)
            for segment, residual in zip(regression.segments, residuals, strict=True)
        ]
    )


def test_an_output_that_no_repeats_have_gets_its_noise_from_the_other_effects() -> None:
    """Repeats without a load predict no tension; a later run under a known weight does."""
    hidden, ride = [term("motor-coulomb", torque=0.2)], Ride(samples=2000)
    repeats = [replace(made(seed, terms=hidden, ride=ride), metadata={}) for seed in range(2)]
    weighed = made(5, terms=hidden, load_mass=25.0, ride=replace(ride, period=5.0))
    found = diagnose([*repeats, weighed], GROOVED).diagnosis
    assert [step.effects for step in found.steps] == [("motor-coulomb",)]
    assert found.outputs["tension"].noise_rms == pytest.approx(NOISE["tension"], rel=0.05)
    sources = [found.outputs[name].noise_source for name in ("tension", "motor_torque")]
    assert sources == ["saturated fit", "repeats"]


def test_the_lowest_frequencies_of_a_long_run_get_their_noise_from_the_other_effects() -> None:
    """They are below those of the short repeats beside it, which have no noise there;
    with less than a degree of freedom no effect would be significant."""
    ride = Ride(samples=400, stroke=60.0)
    repeats = [made(seed, ride=ride) for seed in range(2)]
    longer = made(5, load_mass=20.0, ride=replace(ride, samples=4000, period=40.0))
    noise = diagnose([*repeats, longer], GROOVED).result.noise
    assert noise.dof.min() > 1.9
    assert noise.rms["cable_length"] == pytest.approx(NOISE["cable_length"], rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("colour", [False, True], ids=["white", "coloured"])
def test_p_values_of_noise_alone_are_uniform(colour: bool) -> None:
    """The least of m independent p-values, p, has 1 − (1 − p)^m uniform.

    Bonferroni's m p is cut off at one, so the test is on the cases below, within their range.
    """
    make = coloured if colour else white
    other = np.random.default_rng(CASES)
    regression = length_problem([make(other, RIDE.samples) for _ in range(2)], RIDE)
    bands, chances = len(regression.bands), []
    for seed in range(CASES):
        random = np.random.default_rng([seed, colour])
        measured_anew(regression, [make(random, RIDE.samples) for _ in range(2)])
        chances.append(judged(regression)[0].p_value / bands)
    least = np.array(chances)
    uncut = least[least < 0.999 / bands]
    end = 1 - (1 - 1 / bands) ** bands
    assert len(uncut) > 100
    assert kstest((1 - (1 - uncut) ** bands) / end, "uniform").pvalue > 0.01


@pytest.mark.parametrize("frequency", [0.4, 3.0, 17.0])
def test_a_sine_in_all_repeats_is_a_lack_of_fit_in_its_band(frequency: float) -> None:
    random = np.random.default_rng(5)
    wave = 0.8 * SIZE * np.sin(2 * np.pi * frequency * RIDE.time)
    runs = [wave + white(random, RIDE.samples) for _ in range(2)]
    regression = length_problem(runs, RIDE)
    found, noise = judged(regression)
    assert found.p_value < 1e-3
    assert found.rejected.any()
    for band in np.flatnonzero(found.rejected):
        _, low, high = regression.bands[band]
        # Width of a spectral line in a run of six seconds.
        assert low - 0.5 <= frequency <= high + 0.5
    assert noise.rms["cable_length"] == pytest.approx(SIZE, rel=0.15)


def test_a_sine_of_random_phase_is_noise() -> None:
    random = np.random.default_rng(6)
    wave = 3 * SIZE * np.sin(2 * np.pi * 3.0 * RIDE.time)
    runs = [sign * wave + white(random, RIDE.samples) for sign in (1, -1)]
    found, noise = judged(length_problem(runs, RIDE))
    assert found.p_value > 0.05
    # Opposite waves differ by √2 of what one has: power 9/2 doubled. Its line is smoothed.
    assert 2 * SIZE < noise.rms["cable_length"] < 1.05 * SIZE * np.sqrt(1 + 9)


def test_known_differences_between_repeats_are_not_noise() -> None:
    random = np.random.default_rng(7)
    slope = np.linspace(-1, 1, RIDE.samples)
    runs = [white(random, RIDE.samples) + sign * 5 * SIZE * slope for sign in (1, -1)]
    regression = length_problem(runs, RIDE)
    known = np.concatenate([dct(sign * slope, type=2, norm="ortho") for sign in (1, -1)])
    plain, wise = estimated(regression), estimated(regression, known[:, None])
    assert plain.rms["cable_length"] > 2 * SIZE
    assert wise.rms["cable_length"] == pytest.approx(SIZE, rel=0.1)


def test_unknowns_per_run_do_not_reduce_the_noise_variance() -> None:
    """An offset per run absorbs the slowest noise; the estimated variance stays the same."""
    random = np.random.default_rng(5)
    whole, bare, told = [], [], []
    regression = length_problem([white(random, RIDE.samples) for _ in range(2)], RIDE)
    for _ in range(60):
        measured_anew(regression, [white(random, RIDE.samples) for _ in range(2)])
        levels = np.zeros((regression.n_rows, len(regression.segments)))
        for index, segment in enumerate(regression.segments):
            levels[segment.rows.start : segment.rows.start + 3, index] = 1.0
        residual = fitted(regression).residual
        left = residual - levels @ np.linalg.lstsq(levels, residual)[0]
        none = np.zeros((regression.n_rows, 0))
        first = [
            noise_from_repeats(regression, residual, none).power[0],
            noise_from_repeats(regression, left, none).power[0],
            noise_from_repeats(regression, left, none, levels).power[0],
        ]
        for out, power in zip((whole, bare, told), first, strict=True):
            out.append(power)
    assert np.mean(bare) < 0.95 * np.mean(whole)
    assert np.mean(told) == pytest.approx(np.mean(whole), rel=0.05)


def test_without_repeats_noise_is_the_residual_of_the_saturated_model() -> None:
    random = np.random.default_rng(8)
    ride = Ride(samples=2000)
    model = Hypothesis().with_term(term("drum-radius", radius_error=1e-4), 1)
    regression = length_problem([white(random, 2000)], ride)
    effect = regression.change(model)
    columns = np.column_stack([regression.nuisance_columns, effect])
    residual = regression.residual(Hypothesis()) + 40 * effect
    assert np.std(regression.in_time(residual)[0]) > 20 * SIZE
    noise = noise_saturated(regression, residual, columns)
    assert not noise.from_repeats
    # Two columns take two degrees of freedom, and a third that repeats them none.
    assert np.sum(noise.dof) == pytest.approx(regression.n_rows - 2)
    doubled = noise_saturated(regression, residual, columns, 3 * columns[:, :1])
    assert doubled.power == pytest.approx(noise.power, rel=1e-6)
    assert noise.rms["cable_length"] == pytest.approx(SIZE, rel=0.06)
    quiet = lack_of_fit_test(regression, residual, columns, noise)
    assert np.isnan(quiet.p_value)
    assert not quiet.rejected.any()


def test_a_slow_residual_that_no_candidate_explains_is_not_amplified() -> None:
    """A candidate acts at high frequencies, the residual has a slow part beside it.

    Weights from the residual itself would let the many quiet bands determine the fit, which then
    misses the slow bands by more than the residual that it started from.
    """
    random = np.random.default_rng(9)
    samples = 2000
    regression = length_problem([white(random, samples)], Ride(samples=samples))
    (segment,) = regression.segments
    frequency = segment.band.frequency / segment.band.frequency[-1]
    fast = np.where(frequency > 0.2, random.standard_normal(len(frequency)), 0.0)
    slow = np.where(frequency < 0.02, random.standard_normal(len(frequency)), 0.0)
    column = fast + 30 * slow
    residual = regression.residual(Hypothesis()) + SIZE * (0.5 * fast + 30 * np.roll(slow, 1))
    noise = noise_saturated(regression, residual, column[:, None])
    of_residual = power_in_bands(regression, residual**2)
    scale = float(column @ residual / (column @ column))
    of_least_squares = power_in_bands(regression, (residual - scale * column) ** 2)
    assert np.all(noise.power < 1.2 * of_residual)
    np.testing.assert_allclose(noise.power, of_least_squares, rtol=0.1)


def test_candidates_that_explain_the_slowest_rows_do_not_lower_their_noise() -> None:
    """White noise of which fourteen slow waves explain what the lowest rows have.

    With 14 of the 16 slowest rows explained, χ²(2) is below a hundredth of its mean in one case of
    a hundred, and far below by the choice of the waves: here they are fitted to this noise.
    """
    random = np.random.default_rng(11)
    samples = 2000
    regression = length_problem([white(random, samples)], Ride(samples=samples))
    (segment,) = regression.segments
    residual = regression.residual(Hypothesis())
    waves = np.zeros((regression.n_rows, 14))
    waves[segment.rows.start + np.arange(14), np.arange(14)] = 1.0
    chosen = waves[:, :1].copy()
    slowest = slice(segment.rows.start, segment.rows.start + 16)
    chosen[slowest, 0] = residual[slowest]
    noise = noise_saturated(regression, residual, waves, chosen)
    few = noise.dof < 10
    assert few.any()
    assert np.all(noise.power[few] > 0.5 * SIZE**2), "white noise of that size at all frequencies"
    # Of a noise that rises towards low frequencies nothing is changed.
    rising = length_problem([coloured(random, samples)], Ride(samples=samples))
    left = rising.residual(Hypothesis())
    none = np.zeros((rising.n_rows, 0))
    found = noise_saturated(rising, left, none).power
    np.testing.assert_allclose(found, power_in_bands(rising, left**2), rtol=1e-6)


def test_noise_free_runs_get_the_variance_floor() -> None:
    regression = length_problem(NOTHING, RIDE)
    found, noise = judged(regression)
    assert np.all(noise.power > 0)
    assert found.p_value == 1.0
    assert noise.rms["cable_length"] < 1e-7
