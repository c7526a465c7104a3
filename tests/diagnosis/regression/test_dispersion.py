"""Differences of χ² beside a residual that exceeds the noise.

The data are drawn here: rows of known variance in five bands, two effects that differ in one
direction of the lowest band, and what neither explains. Fits are weighted least squares by NumPy.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.stats import binom, norm, t

from winchkit.arrays import Array
from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.dispersion import fits_worse, largest_loss, overdispersed
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.noise import BandNoise

ROWS = (12, 16, 32, 60, 120)
"""Rows of the bands, from the lowest frequency."""
BAND = np.repeat(np.arange(len(ROWS)), ROWS)
CASES = 2000
LEVEL = 1 / 740
"""Nominal probability that a true effect leaves the set of a wrong one that fits better."""
DATA = cast(
    Regression,
    SimpleNamespace(
        bands=[("torque", float(b), b + 1.0) for b in range(5)],
        band_of_row=BAND,
        power_floor=np.zeros(len(ROWS)),
        share_of_row=np.ones(len(BAND)),
    ),
)
NOISE = BandNoise(np.ones(len(ROWS)), np.full(len(ROWS), 200.0), {"torque": 1.0}, from_repeats=True)

Misfit = Callable[[np.random.Generator], Array]


def nothing(random: np.random.Generator) -> Array:
    return np.zeros(len(BAND))


def slow(random: np.random.Generator) -> Array:
    """Power of 25 times the noise in the lowest band, as no candidate explains."""
    return np.where(BAND == 0, 5.0, 0.0) * random.standard_normal(len(BAND))


def wander(random: np.random.Generator) -> Array:
    """A spectrum of a random walk: of the lowest band the first rows have most of the power."""
    return 30.0 / np.arange(1, len(BAND) + 1) * random.standard_normal(len(BAND))


def fitted(column: Array, measured: Array, noise: BandNoise) -> Fit:
    weight = 1 / np.sqrt(noise.power[BAND])
    (value,), *_ = np.linalg.lstsq(column[:, None] * weight[:, None], measured * weight)
    residual = measured - value * column
    return Fit(
        Hypothesis(),
        np.array([value]),
        residual,
        lambda: column[:, None],
        float(np.sum((residual * weight) ** 2)),
        1,
    )


def rates(misfit: Misfit, separation: float, seed: int = 1) -> tuple[float, float, float, float]:
    """Shares of cases in which the truth, or the wrong effect, leaves the set, by both rules.

    The truth by the residual, by the noise alone; the wrong effect by the residual, by the noise
    alone. ``separation`` is the distance of the two in standard deviations of the noise.
    """
    random = np.random.default_rng(seed)
    truth = np.where(BAND < 2, 1.0, 0.1)
    direction = np.where(BAND == 0, 1.0, 0.0) * random.standard_normal(len(BAND))
    direction -= truth * (direction @ truth) / (truth @ truth)
    wrong = truth + direction * separation / 40.0 / np.sqrt(direction @ direction)
    counts = np.zeros(4)
    for _ in range(CASES):
        measured = 40.0 * truth + misfit(random) + random.standard_normal(len(BAND))
        fits = [fitted(column, measured, NOISE) for column in (truth, wrong)]
        best = min(fits, key=lambda fit: fit.chi_square)
        noise = overdispersed(DATA, best, NOISE)
        again = [fitted(column, measured, noise) for column in (truth, wrong)]
        counts += [
            fits_worse(DATA, again[0], again[1], noise),
            fits[0].chi_square - fits[1].chi_square > 9.0,
            fits_worse(DATA, again[1], again[0], noise),
            fits[1].chi_square - fits[0].chi_square > 9.0,
        ]
    lost, lost_by_noise, out, out_by_noise = (counts / CASES).tolist()
    return lost, lost_by_noise, out, out_by_noise


@pytest.mark.parametrize("misfit", [slow, wander])
@pytest.mark.parametrize("separation", [2.0, 8.0])
def test_a_true_effect_stays_beside_a_wrong_one_at_the_nominal_rate(
    misfit: Misfit, separation: float
) -> None:
    lost, lost_by_noise, _, _ = rates(misfit, separation)
    assert lost <= binom.ppf(0.999, CASES, LEVEL) / CASES
    # Beside the same residual the noise alone takes the truth away in every tenth case or more.
    assert lost_by_noise > 0.1


@pytest.mark.parametrize("separation", [2.0, 3.0, 6.0])
def test_beside_noise_alone_effects_are_distinguished_as_often(separation: float) -> None:
    lost, _, out, out_by_noise = rates(nothing, separation)
    assert lost <= binom.ppf(0.999, CASES, LEVEL) / CASES
    assert out > out_by_noise - 0.1
    # An effect at six standard deviations leaves the set nearly always.
    assert out > 0.95 or separation < 6.0


def test_a_residual_far_above_the_noise_leaves_the_power_of_its_own_variance() -> None:
    """Two effects that differ by far more than what is unexplained are distinguished."""
    lost, _, out, _ = rates(slow, 60.0)
    assert lost == 0.0
    assert out > 0.95


def test_the_limit_is_that_of_known_variances_where_these_are_well_known() -> None:
    assert largest_loss(np.inf) == pytest.approx(norm.isf(LEVEL) ** 2)
    assert largest_loss(1e6) == pytest.approx(9.0, abs=0.01)
    assert largest_loss(4.0) == pytest.approx(t(4).isf(LEVEL) ** 2)


def test_a_residual_below_the_noise_changes_nothing() -> None:
    random = np.random.default_rng(5)
    measured = 0.1 * random.standard_normal(len(BAND))
    one = fitted(np.ones(len(BAND)), measured, NOISE)
    assert overdispersed(DATA, one, NOISE).power == pytest.approx(NOISE.power)


def test_a_variance_of_one_degree_of_freedom_is_replaced_by_that_of_the_residual() -> None:
    random = np.random.default_rng(6)
    one = fitted(np.ones(len(BAND)), random.standard_normal(len(BAND)), NOISE)
    unknown = replace(NOISE, power=NOISE.power / 20.0, dof=np.ones(len(ROWS)))
    taken = overdispersed(DATA, one, unknown)
    assert np.all(np.abs(np.log(taken.power)) < 4 * np.sqrt(2 / taken.dof))
    assert np.all(taken.dof > 3.0)


def test_one_coefficient_with_all_power_counts_as_few_values() -> None:
    """Three values of 12 rows: 3 (Σr²)²/Σr⁴ of a single coefficient."""
    column = np.where(BAND == 1, 1.0, 0.0)
    single, even = np.zeros(len(BAND)), np.where(BAND == 0, 10.0, 0.0)
    single[3] = 10.0
    for measured, expected in ((single, 3.0), (even, 12.0)):
        noise = overdispersed(DATA, fitted(column, measured, NOISE), NOISE)
        assert noise.dof[0] == pytest.approx(expected)
        assert noise.power[0] == pytest.approx(float(measured @ measured) / 12)
