"""Whole orders of an angle: sines k per turn in samples, by one Fourier transform over the turn."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array

_TURN = 2 * np.pi
"""Rad of a turn; definition."""
_MOST_ORDERS = 1000
"""Highest scanned order per motor or drum turn; bound of the parameter `order`."""
_CELLS = 32
"""Cells per shortest period in which samples are summed to find the order; phase error of at most
π/32, loss of power below 0.4 %; the share of the order found is exact."""
_PERIODS = 2
"""Whole periods that the motion must hold for an order: of fewer, any bend is a sine."""
_ENDS = 0.01
"""Part of these periods that may be missing at the ends of the motion; rule of thumb."""
_LARGEST_CONDITION = 1e6
"""Condition of sine and cosine from which an order is not identifiable; numerical: half of the
digits are left."""


def half_of_samples_per_turn(angles: Iterable[Array]) -> int:
    """Highest order that samples of an angle resolve where it turns most slowly; at most 1000.

    It is half of the samples of the slowest whole turn, or of the slowest motion where there is no
    whole turn, and 0 where nothing moves. ``angles`` holds one array (n,) for each run, rad.
    """
    step = np.sort(np.abs(np.concatenate([np.zeros(1), *(np.diff(angle) for angle in angles)])))
    step = step[step > 0]
    if not len(step):
        return 0
    last = min(int(np.searchsorted(np.cumsum(step), _TURN)), len(step) - 1)
    return int(min(_TURN / step[last] / 2, _MOST_ORDERS))


def sums_by_order(
    angle: Array, values: Array, resolved: int, highest: int
) -> NDArray[np.complex128]:
    """Sums Σ x exp(ikθ) over samples, for the orders k from 1 to ``highest``, (highest,).

    Samples are summed within cells of a thirty-second of the period of the order ``resolved``, at
    the phase of the cell's middle, and these sums by one Fourier transform.
    """
    cells = _CELLS * resolved
    cell = np.floor(angle * (cells / _TURN)).astype(np.int64) % cells
    middle = np.exp(0.5j * _TURN / cells * np.arange(1, highest + 1))
    sums = np.fft.rfft(np.bincount(cell, values, cells))[1 : highest + 1]
    return np.asarray(np.conj(sums) * middle)


def strongest_harmonic(angle: Array, error: Array, orders: int) -> tuple[int, float] | None:
    """The order up to ``orders`` whose sine explains most of a residual, and its exact share.

    The motion holds two whole periods of the lowest order. None stands for no residual, or for an
    angle that hardly moves.
    """
    total = float(error @ error)
    if total == 0.0 or not orders:
        return None
    toward, sums = (
        sums_by_order(angle, values, orders, 2 * orders) for values in (error, np.ones(len(error)))
    )
    explained = _explained(toward[:orders], sums[1::2], len(angle))
    explained[: _lowest_order(angle) - 1] = 0.0
    best = int(np.argmax(explained))
    if explained[best] <= 0.0:
        return None
    first = np.exp(1j * (best + 1) * angle)
    exact = _explained(np.array([first @ error]), np.array([np.sum(first**2)]), len(angle))
    return best + 1, float(exact[0]) / total


def _lowest_order(angle: Array) -> int:
    """Lowest order of which the range of an angle, rad, holds two whole periods."""
    travel = float(np.ptp(angle))
    most = 2 * _MOST_ORDERS
    return most if travel <= 0.0 else int(min(np.ceil((_PERIODS - _ENDS) * _TURN / travel), most))


def _explained(toward: NDArray[np.complex128], twice: NDArray[np.complex128], count: int) -> Array:
    """Sum of squares that cosine and sine of each order explain, from the sums of e exp(ikθ) and of
    exp(2ikθ), (orders,); zero where not identifiable."""
    normal = np.empty((len(twice), 2, 2))
    normal[:, 0, 0], normal[:, 1, 1] = (count + twice.real) / 2, (count - twice.real) / 2
    normal[:, 0, 1] = normal[:, 1, 0] = twice.imag / 2
    identifiable = np.linalg.cond(normal) <= _LARGEST_CONDITION
    gradient = np.stack([toward.real, toward.imag], axis=1)[identifiable]
    out = np.zeros(len(twice))
    solved = np.linalg.solve(normal[identifiable], gradient[:, :, None])[:, :, 0]
    out[identifiable] = np.sum(gradient * solved, axis=1)
    return out
