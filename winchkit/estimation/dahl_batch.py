"""Dahl friction along a whole recording."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.estimation.kernels import PLAIN, Kernels
from winchkit.model.friction import dahl, dahl_constant

_FEW = 0.02
"""Reversals per sample up to which whole strokes are quicker than single samples."""


def dahl_batch(
    position: ArrayLike,
    limit: ArrayLike,
    stiffness: float,
    shape: float = 1.0,
    start: float = 0.0,
    *,
    kernels: Kernels = PLAIN,
) -> Array:
    """Dahl friction along a path.

    ``position`` (n,): m. ``limit`` (n,): F_c, N. ``stiffness``: σ, N/m. ``shape``: β. ``start``:
    force at the first sample as a share of the limit, -1 to 1. Returns (n,): N. Raises UsageError
    for shapes that do not fit.

    Notes
    -----
    dF/dx = σ sgn(1 - F/F_c sgn v) |1 - F/F_c sgn v|^β. A constant limit with few reversals is
    computed stroke by stroke; all else sample by sample with compiled kernels, in numpy by a scan
    (β = 1), or in a loop.
    """
    way = np.asarray(position, dtype=float)
    most = np.asarray(limit, dtype=float)
    if way.ndim != 1 or most.ndim > 1 or most.size not in {1, way.size}:
        raise UsageError(
            f"position has the shape {way.shape} and limit {most.shape}; "
            "give a row of positions and one limit, or as many"
        )
    if most.size == 1 and _reversals(way) <= _FEW * way.size:
        return dahl_constant(way, float(most.reshape(())), stiffness, shape, start)
    limits = np.ascontiguousarray(np.broadcast_to(most, way.shape))
    if kernels is PLAIN or not way.size:
        return dahl(way, limits, stiffness, shape, start)
    out = np.empty_like(way)
    moved = np.diff(way, prepend=way[:1])
    kernels.forces(moved, limits, float(stiffness), float(shape), float(start), out)
    return out


def _reversals(position: Array) -> int:
    rises = np.diff(position) > 0
    return int(np.count_nonzero(rises[1:] != rises[:-1]))
