"""Cables from swivelling pulleys to the platform: lengths, directions and wraps.

A cable reaches its pulley at the exit point along the swivel axis s. With n the direction from the
axis to the anchor, the pulley's centre at r n from the exit point, and the anchor at (X, Y) from
the centre along n and s, the point at the wrap φ is r(−cos φ, sin φ), the cable leaves it along
(sin φ, cos φ), and with the free length f = √(X² + Y² − r²)

    sin φ = (f X + r Y)/(X² + Y²),  cos φ = (f Y − r X)/(X² + Y²).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import tau
from typing import NamedTuple

import numpy as np

from winchkit.arrays import Array

__all__ = ["Cables", "Pulleys"]


class Cables(NamedTuple):
    """The n cables at one pose."""

    length: Array
    """Arc and free length, (n,), m."""
    direction: Array
    """Unit vectors from pulley to anchor in the base frame, (n, 3)."""
    wrap: Array
    """(n,), rad."""


@dataclass(frozen=True)
class Pulleys:
    """Exit points and pulleys of n cables."""

    exit_point: Array
    """(n, 3), m."""
    axis: Array
    """Unit vectors, (n, 3)."""
    radius: Array
    """(n,), m; zero for a fixed exit point."""

    def cables(self, anchor: Array) -> Cables:
        """The cables to anchor points in the base frame, (n, 3), m."""
        r, axis = self.radius, self.axis
        seen = anchor - self.exit_point
        y = np.einsum("ij,ij->i", seen, axis)
        radial = seen - y[:, None] * axis
        distance = np.sqrt(np.einsum("ij,ij->i", radial, radial))
        n = radial / np.maximum(distance, 1e-12)[:, None]
        x = distance - r
        square = x * x + y * y
        free = np.sqrt(square - r * r)
        sine, cosine = (free * x + r * y) / square, (free * y - r * x) / square
        wrap = np.arctan2(sine, cosine)
        wrap = np.where(wrap < -1e-9, wrap + tau, wrap)
        return Cables(r * wrap + free, sine[:, None] * n + cosine[:, None] * axis, wrap)
