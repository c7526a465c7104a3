"""Values of a channel from what a caller passes: lists, masked arrays, columns of tables."""

from __future__ import annotations

import math
from typing import Any, TypeGuard

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import UsageError


def is_real(values: object) -> bool:
    """Whether an object is an array of real numbers as the package computes with, (n,)."""
    return type(values) is np.ndarray and values.dtype == np.float64 and values.ndim == 1


def real_numbers(name: str, values: object) -> Array:
    """Argument ``name`` as an array (n,), NaN where masked or missing; raises UsageError."""
    plain = np.ma.filled(values.astype(np.float64), np.nan) if _is_masked(values) else values
    found = np.asarray(plain)
    if found.dtype == object and found.ndim == 1:
        found = np.asarray([math.nan if item is None else item for item in found])
    if found.ndim != 1 or found.dtype.kind not in "fiub":
        kind = found.dtype if found.ndim == 1 else f"of shape {found.shape}"
        kind = kind if isinstance(values, np.ndarray) else f"a {type(values).__name__} ({kind})"
        raise UsageError(f"{name}: {kind} is no array of real numbers; pass one of shape (n,)")
    return np.asarray(found, dtype=np.float64)


def _is_masked(values: object) -> TypeGuard[np.ma.MaskedArray[Any, Any]]:
    return isinstance(values, np.ma.MaskedArray) and values.dtype.kind in "fiub"
