"""The discretisation error of sampled motion, and intervals that cover it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from diagnosis_runs import GROOVED, Array, Ride, made, term
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.regression.discretization import interpolated, without_discretization_error
from winchkit.diagnosis.regression.gls import Fit, fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.intervals import estimates, spread_of
from winchkit.diagnosis.regression.noise import BandNoise, noise_from_repeats
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.effects.term import Term
from winchkit.runs.run import Run

FINER = 16


@dataclass(frozen=True)
class Waves(Ride):
    """A slow wave with a fast one on it, of ten samples a period: smooth at any rate."""

    @property
    def angle(self) -> Array:
        slow, fast = (np.sin(2 * np.pi * self.time / period) for period in (4.1, 0.8))
        return np.asarray(60.0 * slow + 6.0 * fast)


FINE = Waves(samples=400 * FINER, rate=12.5 * FINER)
INERTIA = term("rotor-inertia", inertia=2e-3)
RADIUS = term("drum-radius", radius_error=1e-3)
NOISE = {"motor_torque": 2e-3, "cable_length": 3e-4, "tension": 0.2}


def sampled(seed: int, terms: tuple[Term, ...], every: int = FINER) -> Run:
    """A fine run of which an instrument keeps every sixteenth sample."""
    run = made(seed, GROOVED, terms, NOISE, ride=FINE, encoder=0.0)
    decimate = {n: replace(c, values=c.values[::every]) for n, c in run.channels.items()}
    return replace(run, time=run.time[::every], channels=decimate)


def fitted(
    terms: tuple[Term, ...], every: int = FINER
) -> tuple[TimeSeriesRegression, Fit, BandNoise]:
    regression = TimeSeriesRegression(
        prepare([sampled(s, terms, every) for s in range(4)], GROOVED)
    )
    start = Hypothesis()
    for item in terms:
        start = start.with_term(item, 4)
    first = fit(regression, start, np.ones(regression.n_rows))
    noise = noise_from_repeats(regression, first.residual, np.zeros((regression.n_rows, 0)))
    return regression, fit(regression, start, noise.inverse_sigma(regression)), noise


def test_the_interval_covers_an_inertia_with_discretisation_error() -> None:
    regression, found, noise = fitted((INERTIA,))
    ((_, values),) = estimates(
        regression, found, spread_of(regression, found, noise, regression.blocks)
    )
    inertia = values["inertia"]
    whitened = found.jacobian * noise.inverse_sigma(regression)[:, None]
    at = regression.nuisance_columns.shape[1]
    likelihood = float(np.sqrt(np.linalg.inv(whitened.T @ whitened)[at, at])) * 1e-4
    # Differences over samples this coarse round the acceleration: the value is wrong for certain,
    assert abs(inertia.value - 2e-3) > 4 * likelihood
    # and the interval says so.
    assert inertia.interval is not None
    low, high = inertia.interval
    assert low < 2e-3 < high
    assert abs(inertia.value - 2e-3) < 2 * inertia.std


def test_the_discretisation_error_is_removed_from_the_residual() -> None:
    regression, found, noise = fitted((INERTIA,))
    inverse_sigma = noise.inverse_sigma(regression)
    left = without_discretization_error(regression, found, inverse_sigma)
    before, after = (float(np.sum((r * inverse_sigma) ** 2)) for r in (found.residual, left))
    rows = regression.n_rows
    assert before > 1.2 * rows
    assert after < before - 0.5 * (before - rows)


def test_fine_sampling_or_no_derivative_gives_no_discretisation_error() -> None:
    regression, found, _ = fitted((INERTIA,), every=1)
    coarse, rough, _ = fitted((INERTIA,))
    fine_share, coarse_share = (
        np.sqrt(
            np.mean(p.discretization_error(f.hypothesis) ** 2)
            / np.mean(p.change(f.hypothesis) ** 2)
        )
        for p, f in ((regression, found), (coarse, rough))
    )
    assert fine_share < 0.1 * coarse_share
    length, radius, _ = fitted((RADIUS,))
    own = [s for s in length.segments if s.output == "cable_length"]
    column = length.discretization_error(radius.hypothesis)
    assert all(np.allclose(column[s.rows], 0.0, atol=1e-9) for s in own)


def test_no_effect_gives_no_discretisation_error() -> None:
    regression, found, noise = fitted(())
    assert not regression.discretization_error(found.hypothesis).any()
    assert without_discretization_error(
        regression, found, noise.inverse_sigma(regression)
    ) == pytest.approx(found.residual)


@pytest.mark.parametrize("count", [56, 57, 1000])
def test_the_interpolation_is_scipys_cubic_spline(count: int) -> None:
    values = np.cumsum(np.random.default_rng(count).standard_normal(count))
    there = np.arange(4 * (count - 1) + 1) / 4
    wanted = make_interp_spline(np.arange(count), values, k=3)(there)
    assert interpolated(values) == pytest.approx(wanted, abs=1e-12 * np.ptp(values))
