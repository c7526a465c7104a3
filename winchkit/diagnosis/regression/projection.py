"""What columns take of a residual, from their inner products alone."""

from __future__ import annotations

import numpy as np

from winchkit.arrays import Array

__all__ = ["explained_ss", "explained_ss_of_sets", "orthonormal", "partialled_out"]


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


def orthonormal(columns: Array, most: int | None = None) -> Array:
    """Orthonormal basis of columns, those that add nothing left out; (rows, rank).

    Of more than ``most`` directions the strongest are kept: as many columns as a short run has
    rows would leave no noise at all.
    """
    size = np.sqrt(np.sum(columns**2, axis=0))
    scaled = columns[:, size > 0] / size[size > 0]
    if not scaled.shape[1]:
        return np.zeros((len(columns), 0))
    values, vectors = np.linalg.eigh(scaled.T @ scaled)
    kept = values > 1e-8 * values[-1]
    if most is not None:
        kept[: max(0, len(values) - most)] = False
    return np.asarray(scaled @ (vectors[:, kept] / np.sqrt(values[kept])))


def partialled_out(columns: Array, vector: Array) -> Array:
    """Residual of a vector after its projection on columns, shape (n_rows,)."""
    return np.asarray(vector - columns @ np.linalg.lstsq(columns, vector)[0])
