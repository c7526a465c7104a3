"""Curves that no effect of the catalogue has: whether one explains more than what has a name.

What no catalogue has is often imitated by effects that it has, one or several side by side. A
curve of one output, of the rope's force or of the winding over one variable needs no physics: where
the best of them pays better than the named effects, the names are not what is there. It is never
named itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from winchkit.diagnosis.curves import Columns, curves
from winchkit.diagnosis.gain import gain
from winchkit.diagnosis.noise import orthonormal
from winchkit.diagnosis.problem import Problem

__all__ = ["Beside", "Curve", "best_curve"]

Array = NDArray[np.float64]
_UNIDENTIFIABLE = 1e-7
_NOTHING = 1e-300


@dataclass(frozen=True)
class Curve:
    """A curve over one variable, and what it would save."""

    place: str
    """Output that it is added to, or ``rope force`` or ``winding``, which show in several."""
    variable: str
    pays: float
    """Whitened squares that it takes, less the price of its numbers."""


class Beside:
    """A whitened residual beside which curves are tried, and what explains a part of it."""

    def __init__(self, residual: Array, jacobian: Array, weight: Array) -> None:
        """``residual`` (rows,) with unknowns of derivative ``jacobian`` (rows, k) still free."""
        self.weight = weight
        self.explained = orthonormal(jacobian * weight[:, None])
        whitened = residual * weight
        self.residual = whitened - self.explained @ (self.explained.T @ whitened)

    @property
    def cost(self) -> float:
        """Whitened squares that are left."""
        return float(self.residual @ self.residual)


def best_curve(
    problem: Problem, beside: Beside, outputs: Sequence[str], price: float
) -> Curve | None:
    """The curve that pays best, among those that show in one of ``outputs``.

    ``price`` is what each of its numbers must save.
    """
    best: Curve | None = None
    for place, variable, laws, columns in curves(problem, outputs):
        hats = _inner_products(beside, columns, len(laws[0][0]))
        pays = max(hats.gain(law) - price * freedom for law, freedom in laws)
        if best is None or pays > best.pays:
            best = Curve(place, variable, pays)
    return best


@dataclass(frozen=True)
class _Hats:
    """Inner products of whitened hats, and of what is left of them beside a fit."""

    plain: Array
    """(hats, hats)."""
    inner: Array
    """(hats, hats), without what the fit's unknowns explain."""
    products: Array
    """With the residual, (hats,)."""

    def gain(self, law: Array) -> float:
        """Whitened squares that a law of hats, (hats, k), takes."""
        size = np.sqrt(np.maximum(np.diag(law.T @ self.plain @ law), _NOTHING))
        inner = law.T @ self.inner @ law / np.outer(size, size)
        # Measured by what they were: of what a fit explains whole only rounding is left.
        return gain(inner, (law.T @ self.products) / size, _UNIDENTIFIABLE)


def _inner_products(beside: Beside, columns: Columns, count: int) -> _Hats:
    """Of so many hats, piece by piece."""
    plain, products = np.zeros((count, count)), np.zeros(count)
    through = np.zeros((count, beside.explained.shape[1]))
    for rows, signal in columns:
        whitened = signal * beside.weight[rows]
        plain += whitened @ whitened.T
        through += whitened @ beside.explained[rows]
        products += whitened @ beside.residual[rows]
    return _Hats(plain, plain - through @ through.T, products)
