"""Rounding error that repeats of a motion share.

An instrument with the resolution q shows round((s + n)/q) q of a signal s with noise n of standard
deviation σ. Its error has the mean

    b(s) = Σ (−1)^k q/(π k) sin(2π k s/q) exp(−2π² k² σ²/q²),

a function of the signal: equal motions are rounded alike, and a slow signal has an error as slow.
The rest of the error is white. For σ > q/2 the mean vanishes, and the whole error is white noise of
variance q²/12; for σ = 0 the mean is the whole error.

References
----------
Widrow, B., Kollár, I. (2008). Quantization Noise. Cambridge University Press, ch. 4, 19.
"""

from __future__ import annotations

import numpy as np

from winchkit.arrays import Array
from winchkit.runs.sanity.quantisation import quantisation_noise

_HARMONICS = 8
"""Harmonics of the mean rounding error; numerical: 93 % of its mean square without noise, all of it
from a noise of a tenth of the step; the rest is taken as white."""
_LARGEST = 2.0
"""Noise over step up to which the mean error is taken into account; theory: the mean error of a
noise of a step is 10⁻⁹ of it."""
_GRID = 401
"""Points of the noise over the step; numerical."""


def mean_error(signal: Array, step: float, noise: float) -> tuple[Array, float]:
    """Mean rounding error (n,) as a function of the signal, whose zero is not known to a step."""
    size = _sizes(noise / step) * step
    angle = 2 * np.pi / step * np.outer(np.arange(1, _HARMONICS + 1), signal)
    components = np.concatenate([np.cos(angle), np.sin(angle)]) * np.tile(size, 2)[:, None]
    shared = float(np.sum(size**2))
    return components, max(quantisation_noise(step) ** 2 - shared / 2, 0.0)


def noise_before_rounding(after: float, step: float) -> float:
    """σ before rounding, from the variance after it: σ² + q²/12 − (mean square of mean error)."""
    ratio = np.linspace(0.0, _LARGEST, _GRID)
    squares = np.array([r**2 + 1 / 12 - np.sum(_sizes(r) ** 2) / 2 for r in ratio])
    measured = (after / step) ** 2
    if measured >= squares[-1]:
        return float(np.sqrt(after**2 - quantisation_noise(step) ** 2))
    return float(np.interp(measured, squares, ratio)) * step


def _sizes(ratio: float) -> Array:
    """Amplitudes of the harmonics for a step of one and a noise of ``ratio``."""
    order = np.arange(1, _HARMONICS + 1)
    return np.asarray(np.exp(-2 * (np.pi * order * ratio) ** 2) / (np.pi * order))
