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
    """Sum of squares that a set of columns, of unit length before a projection, explains jointly.

    ``inner`` (k, k) and ``products`` (k,) are inner products of the projected columns, with each
    other and with the residual; directions with an eigenvalue below ``least`` are not identifiable
    and left out.
    """
    return float(explained_ss_of_sets(inner[None], products[None], least)[0])


def explained_ss_of_sets(inner: Array, products: Array, least: float) -> Array:
    """The same for many sets of columns: (n, k, k) and (n, k) to (n,)."""
    values, vectors = np.linalg.eigh(inner)
    along = np.einsum("nji,nj->ni", vectors, products)
    kept = values > least
    return np.asarray(np.sum(along**2 / np.where(kept, values, np.inf), axis=-1))


def orthonormal(columns: Array, most: int | None = None) -> Array:
    """Orthonormal basis of the space of some columns, (n_rows, rank).

    Columns of zeros and linearly dependent ones are dropped. The ``most`` directions with the
    largest eigenvalues are kept, so that a short run keeps degrees of freedom for the noise.
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

    It is zero along columns of zeros and along directions that the rows do not determine; the
    columns may have units of any size.
    """
    return inverse_information(columns.T @ columns)


def inverse_information(normal: Array) -> Array:
    """Pseudo-inverse of a normal matrix, as :func:`inverse_normal`, from the inner products of
    whitened derivatives; its rank does not depend on the units of the unknowns."""
    size = np.sqrt(np.maximum(np.diag(normal), 0.0))
    outer = np.outer(size, size)
    scaled = np.divide(normal, outer, out=np.zeros_like(outer), where=outer > 0.0)
    inverse = np.linalg.pinv(scaled, rcond=_UNIDENTIFIABLE, hermitian=True)
    return np.asarray(np.divide(inverse, outer, out=np.zeros_like(outer), where=outer > 0.0))
