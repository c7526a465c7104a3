"""Overdispersion: differences of χ² where a model leaves more than the noise.

The residual of the better of two models beyond the noise is unexplained and may belong to either:
the variance of a band is then the mean square of the residual (quasi-likelihood).

References
----------
Wedderburn, R. W. M. (1974). Quasi-likelihood functions, generalized linear models, and the
Gauss-Newton method. Biometrika 61, 439-447.
McCullagh, P., Nelder, J. A. (1989). Generalized Linear Models, 2nd ed., ch. 9. Chapman & Hall.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import chdtrc, fdtrc, ndtri, stdtrit

from winchkit.arrays import Array
from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.intervals import whitened_jacobian
from winchkit.diagnosis.regression.noise import BandNoise, satterthwaite_dof, sums_per_band
from winchkit.diagnosis.regression.projection import orthonormal

_EQUAL = 0.05
"""Level of the test that residual and noise of a band have one variance."""
_WORSE = 1 / 740
"""Probability at most that a true effect fits worse by more than the limit of Δχ²."""


def overdispersed(regression: Regression, fit: Fit, noise: BandNoise) -> BandNoise:
    """Variance of every band where a residual may exceed the noise, whose ``rms`` remains.

    The mean square of band b is S_b/ν_b, with ν_b the rows less the leverage of the fitted
    unknowns. Its degrees of freedom are the smaller of ν_b and 3 (Σr²)²/Σr⁴, which is less where
    few coefficients have most of the power, as of a residual that is correlated in time beyond the
    width of the band. Where an F test at 5 % rejects that residual and noise have one variance, the
    larger of the two is taken, else the one with more degrees of freedom: without repeats that of
    the residual, since the noise is what all candidates together leave.
    """
    own, dof = _of_residual(regression, fit, noise)
    ratio = own / noise.power
    p = np.minimum(
        fdtrc(dof, noise.dof, ratio), fdtrc(noise.dof, dof, 1 / np.maximum(ratio, 1e-12))
    )
    residual_taken = np.where(p < _EQUAL, ratio > 1.0, dof > noise.dof)
    return replace(
        noise,
        power=np.where(residual_taken, np.maximum(own, regression.power_floor), noise.power),
        dof=np.where(residual_taken, dof, noise.dof),
    )


def excess_p_value(regression: Regression, fit: Fit, noise: BandNoise) -> float:
    """P-value of a residual that does not exceed the noise (Fisher's combination over bands).

    F test of the residual's mean square against the noise in every band; -2 Σ ln p is χ² with two
    degrees of freedom per band. Noise of the saturated model shares its residual with the fit, so
    that the test is conservative without repeats.

    References
    ----------
    Fisher, R. A. (1932). Statistical Methods for Research Workers, 4th ed., sec. 21.1. Oliver and
    Boyd.
    """
    own, dof = _of_residual(regression, fit, noise)
    p = np.maximum(fdtrc(dof, noise.dof, own / noise.power), np.finfo(float).tiny)
    return float(chdtrc(2 * len(p), -2 * np.sum(np.log(p))))


def _of_residual(regression: Regression, fit: Fit, noise: BandNoise) -> tuple[Array, Array]:
    """Mean square of a residual per band, and its degrees of freedom."""
    count = len(regression.bands)
    bands = regression.band_of_row
    squares = fit.residual**2
    total = sums_per_band(squares, bands, count)
    fourth = sums_per_band(squares**2, bands, count)
    basis = orthonormal(whitened_jacobian(regression, fit, noise))
    rows = sums_per_band(regression.share_of_row - np.sum(basis**2, axis=1), bands, count)
    rows = np.maximum(rows, 1.0)
    effective = np.divide(3 * total**2, fourth, out=np.ones_like(total), where=fourth > 0.0)
    dof = np.clip(effective, 1.0, rows)
    own = total / rows
    return own, dof


def fits_worse(regression: Regression, rival: Fit, best: Fit, noise: BandNoise) -> bool:
    """Whether a rival fits worse than another model by more than a true effect may.

    The limit of Δχ² is the square of the quantile of t at 1 - 1/740: 9 for known variances, where a
    true effect loses that much by three standard deviations of the direction in which the two
    differ. With the difference Δ_b of band b and ν_b of its variance, the degrees of freedom are
    (Σ|Δ_b|)²/Σ(Δ_b²/ν_b) (Satterthwaite): those of the band where one band has all of the
    difference.
    """
    difference = rival.chi_square - best.chi_square
    if difference <= largest_loss(np.inf):
        return False
    change = (rival.residual**2 - best.residual**2) * noise.inverse_sigma(regression) ** 2
    by_band = sums_per_band(change, regression.band_of_row, len(regression.bands))
    dof = float(satterthwaite_dof(np.abs(by_band), noise.dof))
    return difference > largest_loss(dof)


def largest_loss(dof: float) -> float:
    """Limit of Δχ² over a variance of some degrees of freedom; 9 for infinitely many."""
    p = 1.0 - _WORSE
    return float(stdtrit(dof, p) if np.isfinite(dof) else ndtri(p)) ** 2
