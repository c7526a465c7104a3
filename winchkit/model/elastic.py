"""Laws of a cable's elongation: force from strain and inverse (IPAnema paper, Eq. 4, 5 and 6).

The paper writes F = k1 δl + k0 and so on with coefficients of its own test; here the laws are in
strain and in newtons. Their offset k0 cancels in the elongation between two states.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, log, nan

from winchkit.errors import UsageError

_STEPS = 60
"""Convergence is quadratic on the rising branch; a force still without a strain after 60 is not on
it."""
_TOLERANCE = 1e-13
"""Absolute and relative, of a strain: above its rounding (2e-16), below 1 nm on 1 km of cable."""


@dataclass(frozen=True)
class LinearLaw:
    """F = k1 ε + k0 (Eq. 4)."""

    k1: float
    """Axial stiffness EA, N."""
    k0: float = 0.0

    def __post_init__(self) -> None:
        _positive("k1", self.k1)

    def force(self, strain: float) -> float:
        """N."""
        return self.k1 * strain + self.k0

    def strain(self, force: float) -> float:
        """Inverse."""
        return (force - self.k0) / self.k1


@dataclass(frozen=True)
class QuarticLaw:
    """F = k4 ε⁴ + k3 ε³ + k2 ε² + k1 ε + k0 (Eq. 5), on its rising branch from zero strain."""

    k1: float
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    k0: float = 0.0

    def __post_init__(self) -> None:
        _positive("k1", self.k1)

    def force(self, strain: float) -> float:
        """N."""
        bent = self.k1 + strain * (self.k2 + strain * (self.k3 + strain * self.k4))
        return self.k0 + strain * bent

    def slope(self, strain: float) -> float:
        """dF/dε, N."""
        bent = 2 * self.k2 + strain * (3 * self.k3 + strain * 4 * self.k4)
        return self.k1 + strain * bent

    def strain(self, force: float) -> float:
        """Inverse by Newton's method on the rising branch; NaN for a force that is not on it."""
        strain = (force - self.k0) / self.k1
        for _ in range(_STEPS):
            slope = self.slope(strain)
            if slope <= 0.0:
                return nan
            step = (self.force(strain) - force) / slope
            strain -= step
            if abs(step) <= _TOLERANCE * (1.0 + abs(strain)):
                return strain
        return nan


@dataclass(frozen=True)
class ExponentialLaw:
    """F = exp(k1 ε) + k0 in newtons (Eq. 6)."""

    k1: float
    k0: float = 0.0

    def __post_init__(self) -> None:
        _positive("k1", self.k1)

    def force(self, strain: float) -> float:
        """N; infinite where it exceeds the range of a float."""
        from math import exp

        exponent = self.k1 * strain
        return exp(exponent) + self.k0 if exponent < 700.0 else inf

    def strain(self, force: float) -> float:
        """Inverse; NaN at and below k0, the force's lower bound."""
        above = force - self.k0
        return log(above) / self.k1 if above > 0.0 else nan


ElongationLaw = LinearLaw | QuarticLaw | ExponentialLaw
Strain = Callable[[float], float]


def _positive(name: str, value: float) -> None:
    if not value > 0.0:
        raise UsageError(f"{name} of an elongation law is {value:g}; it must be above 0")
