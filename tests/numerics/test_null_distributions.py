"""Tests of the diagnosis against ``scipy.stats``, and their levels on simulated null cases.

Every simulation is seeded. A count of N cases at level α is held within the central 99.9 % of the
binomial distribution B(N, α); distributions are compared by Kolmogorov and Smirnov at 0.1 %.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from math import pi

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats
from scipy.fft import dct

from winchkit.arrays import Array
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.design.discrimination import SEPARATED_AT, power_of
from winchkit.diagnosis.regression.cross_validation import signed_rank_p_value
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.lack_of_fit import lack_of_fit_test, output_p_values
from winchkit.diagnosis.regression.noise import BandNoise, noise_from_repeats
from winchkit.diagnosis.regression.projection import explained_ss
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.selection.scores import Projected, null_maxima, score
from winchkit.diagnosis.selection.signatures import signatures
from winchkit.effects import load_catalogue
from winchkit.fleet.diagnosis.meta_analysis import pooled
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.winch import DrumSpec, GearboxSpec, ReferenceSpec, WinchProfile

PROFILE = WinchProfile(
    name="grooved",
    drum=DrumSpec("grooved", 0.06, groove_pitch=0.005),
    gearbox=GearboxSpec(20.0),
    reference=ReferenceSpec(0.0, 4.0, 4.0),
)
REPEATS, SAMPLES = 3, 256


def within(count: int, cases: int, level: float) -> bool:
    low, high = stats.binom.interval(0.999, cases, level)
    return bool(low <= count <= high)


def no_more_than(count: int, cases: int, level: float) -> bool:
    return bool(count <= stats.binom.ppf(0.9995, cases, level))


@pytest.fixture(scope="module")
def regression() -> TimeSeriesRegression:
    """Lengths of three repeats of one motion, white noise in every kept coefficient."""
    time = np.arange(SAMPLES) / 50.0
    angle = 100.0 * (1 - np.cos(2 * pi * time / time[-1]))
    random = np.random.default_rng(1)
    runs = []
    for index in range(REPEATS):
        length = 4.0 - 0.003 * angle + 1e-4 * random.standard_normal(SAMPLES)
        channels = {"motor_angle": Channel(angle, "rad"), "cable_length": Channel(length, "m")}
        runs.append(Run(f"run-{index}", time, channels, {"load_mass": "10 kg"}))
    return TimeSeriesRegression(prepare(runs, PROFILE))


def residuals(regression: TimeSeriesRegression, cases: int, seed: int) -> Iterator[Array]:
    random = np.random.default_rng(seed)
    for _ in range(cases):
        yield random.standard_normal(regression.n_rows)


def known_noise(regression: TimeSeriesRegression, dof: float) -> BandNoise:
    count = len(regression.bands)
    outputs = dict.fromkeys(regression.outputs, 1.0)
    return BandNoise(np.ones(count), np.full(count, dof), outputs, from_repeats=True)


class TestLackOfFit:
    def test_the_p_value_is_that_of_an_f_test_of_the_mean_of_repeats(
        self, regression: TimeSeriesRegression
    ) -> None:
        noise, jacobian = known_noise(regression, 30.0), regression.nuisance_columns
        for residual in residuals(regression, 5, 2):
            times = np.array(regression.in_time(residual))
            mean = np.asarray(dct(times.sum(axis=0) / np.sqrt(REPEATS), type=2, norm="ortho"))
            band: NDArray[np.intp] = regression.band_of_row[regression.segments[0].rows]
            count = len(regression.bands)
            squares = np.bincount(band, mean**2, count)
            leverage = np.linalg.qr(jacobian)[0] ** 2
            taken = np.bincount(regression.band_of_row, leverage.sum(axis=1), count)
            dof = np.maximum(np.bincount(band, minlength=count) - taken, 1.0)
            p = stats.f.sf(squares / dof, dof, 30.0)
            found = lack_of_fit_test(regression, residual, jacobian, noise)
            assert found.p_value == pytest.approx(min(1.0, count * p.min()), rel=1e-9)
            np.testing.assert_array_equal(found.rejected, count * p < 0.05)

    def test_noise_alone_is_rejected_no_more_often_than_the_level(
        self, regression: TimeSeriesRegression
    ) -> None:
        cases, none = 500, np.zeros((regression.n_rows, 0))
        p_values = []
        for residual in residuals(regression, cases, 3):
            noise = noise_from_repeats(regression, residual, none)
            p_values.append(lack_of_fit_test(regression, residual, none, noise).p_value)
        for level in (0.02, 0.05, 0.2):
            assert no_more_than(int(np.count_nonzero(np.array(p_values) < level)), cases, level)

    @pytest.mark.parametrize("slope", [0.0, 1.0], ids=["white", "low"])
    def test_the_whole_power_of_noise_is_rejected_no_more_often_than_the_level(
        self, regression: TimeSeriesRegression, slope: float
    ) -> None:
        """Also where nearly all of it lies in the lowest bands, of few degrees of freedom."""
        cases, none = 300, np.zeros((regression.n_rows, 0))
        size = (1.0 + regression.band_of_row) ** -slope
        p_values, ratios = [], []
        for residual in residuals(regression, cases, 6):
            noise = noise_from_repeats(regression, residual * size, none)
            p_values.append(output_p_values(regression, residual * size, none, noise))
            ratios.append(
                np.sum((residual * size) ** 2) / np.sum(noise.power[regression.band_of_row])
            )
        found = np.array([p["cable_length"] for p in p_values])
        for level in (0.01, 0.05, 0.2):
            assert no_more_than(int(np.count_nonzero(found < level)), cases, level)
        if slope:
            assert np.mean(np.sqrt(ratios) > 1.1) > 0.02, "the ratio of two rms values says little"

    def test_a_wave_in_all_repeats_is_beyond_the_noise(
        self, regression: TimeSeriesRegression
    ) -> None:
        none = np.zeros((regression.n_rows, 0))
        row = regression.segments[0].rows.start + 20
        (residual,) = residuals(regression, 1, 7)
        for segment in regression.segments:
            residual[segment.rows.start + row - regression.segments[0].rows.start] += 12.0
        noise = noise_from_repeats(regression, residual, none)
        assert output_p_values(regression, residual, none, noise)["cable_length"] < 1e-3


class TestSignedRanks:
    def test_the_p_value_is_that_of_all_assignments_of_signs(self) -> None:
        random = np.random.default_rng(4)
        for _ in range(5):
            change = random.standard_normal(10) + 0.4
            ranks = stats.rankdata(np.abs(change))
            reached = ranks[change > 0].sum()
            sums = [ranks[np.array(signs)].sum() for signs in product([True, False], repeat=10)]
            exact = float(np.mean(np.array(sums) >= reached))
            before = np.full(10, 100.0)
            assert signed_rank_p_value(before, before - change) == pytest.approx(exact, rel=1e-9)

    def test_it_is_scipys_test_of_the_blocks_that_change(self) -> None:
        random = np.random.default_rng(5)
        change = np.concatenate([random.standard_normal(20), 1e-4 * random.standard_normal(28)])
        before = np.full(48, 100.0)
        wanted = stats.wilcoxon(change[:20], alternative="greater").pvalue
        size = np.abs(change[:20])
        assert size.min() > 0.02 * size.max()
        assert signed_rank_p_value(before, before - change) == pytest.approx(wanted, rel=1e-6)

    def test_many_blocks_and_equal_changes_have_scipys_approximation(self) -> None:
        random = np.random.default_rng(7)
        many = 0.2 + random.standard_normal(80)
        equal = np.repeat([1.0, -0.5, 0.7, 0.9, -0.8, 0.6, 0.4, 0.3], 2)
        for change in (many[np.abs(many) > 0.02 * np.abs(many).max()], equal):
            before = np.full(len(change), 100.0)
            wanted = stats.wilcoxon(change, alternative="greater", method="asymptotic").pvalue
            assert signed_rank_p_value(before, before - change) == pytest.approx(wanted, rel=1e-9)

    @pytest.mark.slow
    def test_changes_about_zero_are_accepted_as_often_as_the_level(self) -> None:
        random, cases = np.random.default_rng(6), 1500
        before, p_values = np.full(48, 1000.0), []
        for _ in range(cases):
            p_values.append(signed_rank_p_value(before, before - random.standard_t(3, 48)))
        for level in (0.02, 0.1, 0.5):
            assert within(int(np.count_nonzero(np.array(p_values) <= level)), cases, level)


class TestChiSquare:
    @pytest.mark.parametrize("unknowns", [1, 3])
    def test_squares_explained_by_chance_are_chi_square(self, unknowns: int) -> None:
        random = np.random.default_rng(9)
        columns = random.standard_normal((200, unknowns))
        columns /= np.linalg.norm(columns, axis=0)
        inner = columns.T @ columns
        explained = [
            explained_ss(inner, columns.T @ random.standard_normal(200), 1e-7) for _ in range(1000)
        ]
        assert stats.kstest(explained, stats.chi2(unknowns).cdf).pvalue > 0.001

    def test_the_level_of_a_separation_is_five_percent(self) -> None:
        assert stats.chi2.sf(SEPARATED_AT, 1) == pytest.approx(0.05, abs=1e-4)

    @pytest.mark.parametrize("strength", [0.0, 1.0, 6.0, 10.5])
    def test_power_is_that_of_simulated_differences(self, strength: float) -> None:
        random, cases = np.random.default_rng(10), 4000
        squares = (random.standard_normal(cases) + np.sqrt(strength)) ** 2
        count = int(np.count_nonzero(squares > SEPARATED_AT))
        assert within(count, cases, power_of(strength))

    def test_power_of_one_degree_of_freedom_is_a_lower_bound_of_more(self) -> None:
        for strength in (5.0, 20.0):
            for needed in (10.0, 20.0):
                assert power_of(strength, needed) <= stats.ncx2.sf(needed, 3, strength)


class TestLargestScore:
    def test_simulated_scores_are_those_of_noise(self, regression: TimeSeriesRegression) -> None:
        """The largest of all candidates, beside the nuisance parameters, of known noise."""
        effects = [effect for effect in load_catalogue() if not effect.memory]
        found = signatures(regression, Hypothesis(), effects)
        assert len(found.candidates) > 5
        projected = Projected(
            regression, found, regression.nuisance_columns, known_noise(regression, 1e9)
        )
        simulated = null_maxima(projected, regression.n_rows)
        drawn = []
        for residual in residuals(regression, len(simulated), 11):
            drawn.append(
                max(item.net_gain for item in score(projected, residual, regression.n_rows))
            )
        assert stats.ks_2samp(simulated, drawn).pvalue > 0.001

    def test_scores_do_not_depend_on_the_units_of_the_unknowns(
        self, regression: TimeSeriesRegression
    ) -> None:
        """An unknown in nanometres is partialled out as one in metres."""
        effects = [effect for effect in load_catalogue() if not effect.memory]
        found = signatures(regression, Hypothesis(), effects)
        noise, phase = known_noise(regression, 1e9), np.linspace(0.0, 20.0, regression.n_rows)
        columns = np.column_stack([regression.nuisance_columns, np.sin(phase), np.cos(phase)])
        units = np.logspace(-9, 9, columns.shape[1])
        residual = next(residuals(regression, 1, 12))
        plain, scaled = (
            score(Projected(regression, found, given, noise), residual, regression.n_rows)
            for given in (columns, columns * units)
        )
        assert [item.candidate for item in scaled] == [item.candidate for item in plain]
        np.testing.assert_allclose(
            [item.explained_ss for item in scaled],
            [item.explained_ss for item in plain],
            rtol=1e-6,
            atol=1e-9,
        )


class TestSeveralWinches:
    def test_homogeneity_is_cochrans_test(self) -> None:
        random, winches = np.random.default_rng(12), 6
        std = random.uniform(0.5, 2.0, winches)
        p_values = []
        for _ in range(500):
            values = 7.0 + std * random.standard_normal(winches)
            named = {str(i): (float(values[i]), float(std[i])) for i in range(winches)}
            found = pooled(named, "m", reciprocal=False)
            weight = 1 / std**2
            q = float(np.sum(weight * (values - np.average(values, weights=weight)) ** 2))
            assert found.chi_square == pytest.approx(q, rel=1e-9)
            assert found.p_value == pytest.approx(stats.chi2.sf(q, winches - 1), rel=1e-9)
            p_values.append(found.p_value)
        assert stats.kstest(p_values, "uniform").pvalue > 0.001

    def test_the_spread_between_winches_is_dersimonians_and_lairds(self) -> None:
        values, std = np.array([1.0, 2.0, 4.0, 7.0]), np.array([1.0, 1.5, 1.0, 2.0])
        weight = 1 / std**2
        mean = np.average(values, weights=weight)
        q = float(np.sum(weight * (values - mean) ** 2))
        between = (q - 3) / (weight.sum() - np.sum(weight**2) / weight.sum())
        weight = 1 / (std**2 + between)
        named = {str(i): (float(values[i]), float(std[i])) for i in range(4)}
        found = pooled(named, "m", reciprocal=False)
        assert found.p_value > 0.01
        assert found.spread == pytest.approx(np.sqrt(between), rel=1e-9)
        assert found.value == pytest.approx(np.average(values, weights=weight), rel=1e-9)
        assert found.std == pytest.approx(1 / np.sqrt(weight.sum()), rel=1e-9)
