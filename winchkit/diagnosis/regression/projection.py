"""What columns take of a residual, from their inner products alone."""

from __future__ import annotations

import numpy as np

from winchkit.arrays import Array

__all__ = ["explained_ss", "explained_ss_of_sets"]


def explained_ss(inner: Array, products: Array, least: float) -> float:
    """Whitened squares that k columns take side by side.

    ``inner`` (k, k) and ``products`` with the residual (k,) are of columns scaled to length one
    before anything was projected out; directions shorter than the root of ``least`` are left out.
    """
    return float(explained_ss_of_sets(inner[None], products[None], least)[0])


def explained_ss_of_sets(inner: Array, products: Array, least: float) -> Array:
    """The same for many sets of columns: (n, k, k) and (n, k) → (n,)."""
    values, vectors = np.linalg.eigh(inner)
    along = np.einsum("nji,nj->ni", vectors, products)
    kept = values > least
    return np.asarray(np.sum(along**2 / np.where(kept, values, np.inf), axis=-1))
