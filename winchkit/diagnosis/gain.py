"""What columns take of a residual, from their inner products alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["gain"]

Array = NDArray[np.float64]


def gain(inner: Array, products: Array, least: float) -> float:
    """Whitened squares that k columns take side by side.

    ``inner`` (k, k) and ``products`` with the residual (k,) are of columns scaled to length one
    before anything was projected out; directions shorter than the root of ``least`` are left out.
    """
    values, vectors = np.linalg.eigh(inner)
    kept = values > least
    along = vectors[:, kept].T @ products
    return float(np.sum(along**2 / values[kept]))
