"""Exit points and swivelling pulleys from which the cables of a platform come."""

from __future__ import annotations

from dataclasses import dataclass

from winchkit.arrays import Array

__all__ = ["Pulleys"]


@dataclass(frozen=True)
class Pulleys:
    """Exit points and pulleys of n cables."""

    exit_point: Array
    """(n, 3), m."""
    axis: Array
    """Unit vectors, (n, 3)."""
    radius: Array
    """(n,), m; zero for a fixed exit point."""
