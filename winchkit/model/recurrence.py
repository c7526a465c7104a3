"""Recurrences (linear filter, backlash, first-order lag) solved by a parallel prefix scan.

Each step of a recurrence is a map y → f_k(y). Maps of one kind compose into the same kind, so that
log₂ n passes over the arrays give all partial compositions (Hillis and Steele, 1986).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from winchkit.arrays import Array

_FORGOTTEN = 1e-18
"""Product of decays below which earlier samples are left out: their share is below the rounding
(2e-16) of a state that they could exceed a hundredfold."""


def linear(decay: Array, drive: Array, start: float) -> Array:
    """Solve y_k = decay_k y_{k−1} + drive_k with y_{−1} = ``start``; shapes (n,), |decay| ≤ 1."""
    a = decay.astype(float, copy=True)
    b = drive.astype(float, copy=True)
    if len(b):
        b[0] += a[0] * start
        a[0] = 0.0
    step = 1
    while step < len(b):
        b[step:] += a[step:] * b[:-step].copy()
        a[step:] *= a[:-step].copy()
        step *= 2
        if step < len(b) and np.max(np.abs(a)) < _FORGOTTEN:
            break
    return b


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
