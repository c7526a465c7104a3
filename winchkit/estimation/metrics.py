"""Figures of merit of a tension control in the winding-device paper (Eq. 28 and 29)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from winchkit.errors import UsageError


def overshoot(force: ArrayLike, target: float) -> float:
    """Overshoot over a constant target F_o, N, (max F − F_o)/F_o (Eq. 28); NaN without a finite
    sample. Raises UsageError for a target that is not positive."""
    if not target > 0:
        raise UsageError(f"overshoot is relative to a target of {target:g} N; it must be above 0")
    values = np.asarray(force, dtype=float)
    finite = values[np.isfinite(values)]
    return float(finite.max() / target - 1) if finite.size else float("nan")


def mean_relative_error(force: ArrayLike, target: ArrayLike) -> float:
    """Mean of |F − F_o|/F_o (Eq. 29); NaN without any. Raises UsageError for a target that is not
    positive."""
    values, wanted = np.broadcast_arrays(
        np.asarray(force, dtype=float), np.asarray(target, dtype=float)
    )
    if np.any(wanted <= 0):
        raise UsageError(
            f"a relative error needs targets above 0; the lowest is {float(np.min(wanted)):g} N"
        )
    error = np.abs(values - wanted) / wanted
    finite = error[np.isfinite(error)]
    return float(finite.mean()) if finite.size else float("nan")
