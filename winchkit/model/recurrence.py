"""Recurrences: linear filter, first-order lag, and backlash by a parallel prefix scan.

A step of a backlash is a clamp. Two clamps compose into one, so that log₂ n passes over the arrays
give all partial compositions (Hillis and Steele, 1986).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from winchkit.arrays import Array


def linear(decay: Array, drive: Array, start: float) -> Array:
    """Solve y_k = decay_k y_{k−1} + drive_k with y_{−1} = ``start``; shapes (n,), |decay| ≤ 1.

    A triangular system of equations with one band below its unit diagonal.
    """
    from scipy.linalg.blas import dtbsv  # Slow to import, and needed by hysteresis and lags only.

    if not len(drive):
        return drive.astype(float)
    band = np.empty((2, len(decay)), order="F")
    band[1, :-1] = -decay[1:]
    right = drive.astype(float)
    right[0] += decay[0] * start
    return np.asarray(dtbsv(1, band, right, lower=1, diag=1, overwrite_x=1))


def share(part: ArrayLike, whole: ArrayLike, otherwise: ArrayLike = 0.0) -> Array:
    """Part/whole, and ``otherwise`` where the whole is zero; shapes broadcast."""
    is_some = np.asanyarray(whole) != 0
    return np.where(is_some, part / np.where(is_some, whole, 1.0), otherwise)


def play(x: Array, gap: float, start: float = 0.0) -> Array:
    """Output of a backlash (play operator).

    ``x`` (n,). ``gap``: width of the backlash, in the unit of ``x``. ``start``: initial position
    within the gap as a share of it, −½ to ½; 0 is the middle. Returns (n,): in the unit of ``x``.
    """
    low = x - gap / 2
    high = x + gap / 2
    if len(x):
        low[0] = high[0] = x[0] + gap * np.clip(start, -0.5, 0.5)
    step = 1
    while step < len(x):
        # The composition of two clamps is a clamp.
        earlier_low, earlier_high = low[:-step].copy(), high[:-step].copy()
        low[step:], high[step:] = (
            np.clip(earlier_low, low[step:], high[step:]),
            np.clip(earlier_high, low[step:], high[step:]),
        )
        step *= 2
    return low


def first_order_lag(
    x: Array, time: Array, time_constant: float, start: float | None = None
) -> Array:
    """First-order low-pass, exact for an input that is linear between samples.

    ``x``, ``time`` (n,): input, and its times, s. ``time_constant``: s; zero returns ``x``.
    ``start``: by default the first input. Returns (n,): in the unit of ``x``.
    """
    if time_constant <= 0 or not len(x):
        return x.copy()
    h = np.diff(time) / time_constant
    decay = np.exp(-h)
    mean = -np.expm1(-h) / h
    drive = (mean - decay) * x[:-1] + (1 - mean) * x[1:]
    y0 = x[0] if start is None else start
    return np.concatenate([[y0], linear(decay, drive, y0)])
