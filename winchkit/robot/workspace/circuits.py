"""Whether cables within force limits balance wrenches, exactly and for many poses at once.

At a pose with the structure matrix Aᵀ (m, n) and the wrench w, the forces that balance it are
f = f₀ + N λ with a null space N (n, r), r = n − m. Some of them lie within l ≤ f ≤ h exactly if no
vector y with yᵀ N = 0 separates f₀ from the limits (Farkas' lemma), and it is enough to test the
y of least support, the circuits of the matroid of N's rows: one for each choice of r + 1 cables,
whose elements are the minors of N without one of these rows. With the middle c and the half width
b of the limits the condition is

    |y (f₀ − c)| ≤ |y| b

and the largest distance that all forces can have from their limits at once is the least of
(|y| b − |y (f₀ − c)|)/Σ|y|, at most the least b. Wrenches from a ball about w add the radius times
the norm of z, where y = A z. The cables can give wrenches of every direction (wrench closure)
exactly if every y has elements of both signs (Stiemke's lemma).

References
----------
R. T. Rockafellar, *The elementary vectors of a subspace of R^N*, 1969. S. Bouchard, C. Gosselin,
B. Moore, *On the ability of a cable-driven robot to generate a prescribed set of wrenches*, 2010
(the same facets in the space of wrenches).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array

_REGULAR = 1e-6
"""Least determinant of a basis of the cables' wrenches, as a share of the product of their norms,
that counts as regular: the rounding of a solution is then below 1e-9."""
_ELEMENT = 1e-9
"""Σ|y| below this share of the largest minor is rounding: these rows have more than one circuit,
which other choices show."""
_BASES = 40
"""Most choices of basis cables; poses that none suits are singular (rule of thumb)."""


@dataclass(frozen=True)
class Wrenches:
    """What the cables are to balance at p poses, in the m free coordinates."""

    structure: Array
    """Structure matrices Aᵀ, (p, m, n), moments divided by a lever, so that all rows are alike."""
    wrench: Array
    """w, (p, m), N; moments divided by the same lever."""
    low: Array
    """Least cable forces, (n,), N."""
    high: Array
    """Greatest ones, (n,), N."""
    force: tuple[float, float] = (0.0, 0.0)
    """Radii of further forces and of moments of any direction, N, the latter over the lever."""
    forces: int = 3
    """Number of rows of forces; those of moments follow."""


def margins(given: Wrenches) -> tuple[Array, Array]:
    """Levels of wrench feasibility, N, and of wrench closure, (p,) each; −inf at singular poses.

    The largest distance of all forces from their limits, negative where none within them balance
    all wrenches; and the least ratio of the smaller of the largest elements of either sign to Σ|y|,
    negative where some wrench needs a pushing cable.
    """
    feasible, closed = (np.full(len(given.structure), -np.inf) for _ in range(2))
    left = np.flatnonzero(np.isfinite(given.structure).all(axis=(1, 2)))
    for _ in range(_BASES):
        if not len(left):
            break
        basis = _basis_columns(given.structure[left[0]])
        square = given.structure[left][:, :, basis]
        size = np.prod(np.linalg.norm(square, axis=1), axis=1)
        regular = np.abs(np.linalg.det(square)) > _REGULAR * np.maximum(size, 1e-300)
        which = left[regular]
        if len(which):
            inverse = np.linalg.inv(square[regular])
            feasible[which], closed[which] = _levels(given, which, basis, inverse)
        # The first pose had the best of all bases of its own: no other suits it.
        left = left[~regular]
        left = left[1:] if not regular[0] else left
    return feasible, closed


def _basis_columns(structure: Array) -> NDArray[np.intp]:
    """Cables whose wrenches are most independent of each other (QR with pivots), (m,)."""
    from scipy.linalg import qr

    return np.sort(qr(structure, mode="r", pivoting=True)[1][: len(structure)])


def _levels(
    given: Wrenches,
    which: NDArray[np.intp],
    basis: NDArray[np.intp],
    inverse: Array,
) -> tuple[Array, Array]:
    structure, (count, m) = given.structure[which], inverse.shape[:2]
    low, high = given.low, given.high
    n = structure.shape[2]
    rest = np.setdiff1d(np.arange(n), basis)
    # Poses come last, so that cables and circuits are rows that are contiguous in memory.
    null = np.zeros((n, n - m, count))
    null[basis] = np.moveaxis(-inverse @ structure[:, :, rest], 0, 2)
    null[rest, np.arange(n - m)] = 1.0
    shifted = np.repeat(-(low + high)[:, None] / 2, count, axis=1)
    shifted[basis] -= (inverse @ given.wrench[which][..., None])[..., 0].T
    minor = _minors(null)
    members, sources, signs = _circuits(n, n - m)
    half = (high - low) / 2
    y = minor[sources[:, 0]]
    most, least, total = y.copy(), y.copy(), np.abs(y)
    along, reach = y * shifted[members[:, 0]], total * half[members[:, 0], None]
    for k in range(1, n - m + 1):
        y = minor[sources[:, k]]
        y *= signs[k]
        np.maximum(most, y, out=most)
        np.minimum(least, y, out=least)
        size = np.abs(y)
        total += size
        size *= half[members[:, k], None]
        reach += size
        y *= shifted[members[:, k]]
        along += y
    reach -= np.abs(along)
    if any(given.force):
        reach -= _of_ball(given, basis, inverse, minor)
    total = np.where(total > _ELEMENT * np.max(np.abs(minor), axis=0), total, np.nan)
    mixed = np.minimum(most, -least) if n > m else -total
    feasible, closed = (np.nanmin(level / total, axis=0) for level in (reach, mixed))
    return np.minimum(feasible, half.min()), closed


def _of_ball(given: Wrenches, basis: NDArray[np.intp], inverse: Array, minor: Array) -> Array:
    """Part of the reach that further wrenches of any direction take, (circuits, p)."""
    n, m = given.structure.shape[2], inverse.shape[1]
    members, sources, signs = _circuits(n, n - m)
    y = np.zeros((len(members), n, len(inverse)))
    for k in range(members.shape[1]):
        y[np.arange(len(members)), members[:, k]] = minor[sources[:, k]] * signs[k]
    along = np.einsum("cip,pij->jcp", y[:, basis], inverse)
    parts = along[: given.forces], along[given.forces :]
    sizes = (np.sqrt(np.sum(part**2, axis=0)) for part in parts)
    return np.asarray(sum(r * size for r, size in zip(given.force, sizes, strict=True)))


def _minors(null: Array) -> Array:
    """Determinants of every choice of r rows of (n, r, p), (choices, p)."""
    n, r, count = null.shape
    if r == 0:
        return np.ones((1, count))
    chosen = np.array(list(combinations(range(n), r)))
    if r == 1:
        return null[:, 0]
    if r == 2:
        a, b = null[chosen[:, 0]], null[chosen[:, 1]]
        return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    return np.asarray(np.linalg.det(np.moveaxis(null[chosen], 3, 0))).T


@lru_cache(maxsize=8)
def _circuits(n: int, r: int) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
    """Cables of each circuit (c, r + 1), the minors that are its elements, and their signs."""
    number = {rows: k for k, rows in enumerate(combinations(range(n), r))}
    members = list(combinations(range(n), r + 1))
    sources = [[number[(*one[:k], *one[k + 1 :])] for k in range(r + 1)] for one in members]
    signs = np.array([(-1.0) ** k for k in range(r + 1)])
    return np.array(members, dtype=np.intp), np.array(sources, dtype=np.intp), signs
