"""Projections: orthonormal bases, partialling out, explained sum of squares."""

from __future__ import annotations

import numpy as np

from winchkit.arrays import Array

_UNIDENTIFIABLE = 1e-12
"""Eigenvalue of a scaled normal matrix, over the largest, below which a direction is not
determined; numerical."""
LEAST_EIGENVALUE = 1e-8
"""Eigenvalues of scaled inner products below this share of the largest are no direction."""


def explained_ss(inner: Array, products: Array, least: float) -> float:
    """Sum of squares that a set of columns explains jointly.

    ``inner``: inner products of the columns after projection, shape (k, k). The columns had unit
    length before the projection. ``products``: inner products with the residual, shape (k,).
    ``least``: eigenvalue of ``inner`` below which a direction is not identifiable and left out.
    """
    return float(explained_ss_of_sets(inner[None], products[None], least)[0])


def explained_ss_of_sets(inner: Array, products: Array, least: float) -> Array:
    """The same for many sets of columns: (n, k, k) and (n, k) to (n,)."""
    values, vectors = np.linalg.eigh(inner)
    along = np.einsum("nji,nj->ni", vectors, products)
    kept = values > least
    return np.asarray(np.sum(along**2 / np.where(kept, values, np.inf), axis=-1))


def orthonormal(columns: Array, most: int | None = None) -> Array:
    """Orthonormal basis of the space of some columns.

    ``columns``: shape (n_rows, k); columns of zeros and linearly dependent ones are dropped.
    ``most``: maximum rank: the directions with the largest eigenvalues are kept, so that a short
    run keeps degrees of freedom for the noise. Returns: (n_rows, rank).
    """
    size = np.sqrt(np.sum(columns**2, axis=0))
    scaled = columns[:, size > 0] / size[size > 0]
    if not scaled.shape[1]:
        return np.zeros((len(columns), 0))
    values, vectors = np.linalg.eigh(scaled.T @ scaled)
    kept = values > LEAST_EIGENVALUE * values[-1]
    if most is not None:
        kept[: max(0, len(values) - most)] = False
    return np.asarray(scaled @ (vectors[:, kept] / np.sqrt(values[kept])))


def partialled_out(columns: Array, vector: Array) -> Array:
    """Residual of a vector after its projection on columns, shape (n_rows,)."""
    return np.asarray(vector - columns @ np.linalg.lstsq(columns, vector)[0])


def inverse_normal(columns: Array) -> Array:
    """Pseudo-inverse of the normal matrix: the covariance of unknowns with whitened derivatives.

    ``columns``: shape (n_rows, k), in units of any size. Returns (k, k): zero along columns of
    zeros and along directions that the rows do not determine.
    """
    return inverse_information(columns.T @ columns)


def inverse_information(normal: Array) -> Array:
    """Pseudo-inverse of a normal matrix, whose rank does not depend on the units of its unknowns.

    ``normal``: inner products of whitened derivatives, (k, k). Returns (k, k): as
    :func:`inverse_normal`.
    """
    size = np.sqrt(np.maximum(np.diag(normal), 0.0))
    outer = np.outer(size, size)
    scaled = np.divide(normal, outer, out=np.zeros_like(outer), where=outer > 0.0)
    inverse = np.linalg.pinv(scaled, rcond=_UNIDENTIFIABLE, hermitian=True)
    return np.asarray(np.divide(inverse, outer, out=np.zeros_like(outer), where=outer > 0.0))
