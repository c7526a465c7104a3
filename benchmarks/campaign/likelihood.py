"""The generator's likelihood: of recorded runs, whose noise it knows as it added it itself.

The noise of an output is white (rounding included, step²/12) and, for a part of its power, AR(1)
with the coefficient 0.9 per sample. The precision Q of an AR(1) sequence is tridiagonal, also where
samples are missing (a Markov chain), so that Σ⁻¹ = I/w − (Q + I/w)⁻¹/w², w the white variance, is
applied exactly by a banded Cholesky decomposition.

References
----------
Rue, H., Held, L. (2005). Gaussian Markov Random Fields. Chapman & Hall, ch. 1-2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded

from campaign.record import AR
from winchkit.arrays import Array


def gram(columns: Array, rows: NDArray[np.intp], white: float, coloured: float) -> Array:
    """Products CᵀΣ⁻¹C of columns (n, k) at increasing sample numbers ``rows`` (n,); (k, k).

    ``white`` and ``coloured`` are the variances of the two parts.
    """
    plain = columns.T @ columns / white
    if coloured == 0 or len(rows) < 2:
        return plain
    banded = _ar_precision(rows, coloured)
    banded[1] += 1 / white
    return plain - columns.T @ solveh_banded(banded, columns) / white**2


def _ar_precision(rows: NDArray[np.intp], variance: float) -> Array:
    """Precision of AR(1) at some samples, upper banded form (2, n)."""
    correlation = AR ** np.diff(rows).astype(float)
    fresh = 1 - correlation**2
    out = np.zeros((2, len(rows)))
    out[1, 0] = 1.0
    out[1, 1:] = 1 / fresh
    out[1, :-1] += correlation**2 / fresh
    out[0, 1:] = -correlation / fresh
    return out / variance


def without(products: Array, nuisance: Sequence[int]) -> Array:
    """Products of columns after the least-squares fit of the nuisance ones, same shape."""
    own = list(nuisance)
    if not own:
        return products
    cross = products[:, own]
    return np.asarray(products - cross @ np.linalg.pinv(cross[own], hermitian=True) @ cross.T)


def least_along(products: Array, goal: int, knots: Sequence[int]) -> float:
    """Least square of goal − d, d on the broken line from zero through the knots."""
    best, start = float(products[goal, goal]), np.zeros(len(products))
    for knot in knots:
        along = -start
        along[knot] += 1.0
        away = -start
        away[goal] += 1.0
        length = float(along @ products @ along)
        part = float(np.clip(along @ products @ away / length, 0, 1)) if length > 0 else 0.0
        away -= part * along
        best = min(best, float(away @ products @ away))
        start = np.zeros(len(products))
        start[knot] = 1.0
    return best
