"""Dahl friction along a whole recording at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.estimation.kernels import PLAIN, Kernels
from winchkit.model.friction import dahl, dahl_constant

__all__ = ["dahl_batch"]

_FEW = 0.02
"""Reversals a sample up to which whole pieces are quicker than samples."""


def dahl_batch(
    position: ArrayLike,
    limit: ArrayLike,
    stiffness: float,
    shape: float = 1.0,
    start: float = 0.0,
    *,
    kernels: Kernels = PLAIN,
) -> Array:
    """Friction along ``position`` (m) under a ``limit`` F_c (N), a number or an array; (n,), N.

    ``stiffness`` σ in N/m, ``shape`` β, ``start`` the force at the first sample as a share of
    the limit, −1 to 1. A constant limit with few reversals is followed from one to the next, all
    else sample by sample with compiled ``kernels``, or in numpy by a scan (β = 1) and else in a
    loop. Raises UsageError for shapes that do not fit.
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
