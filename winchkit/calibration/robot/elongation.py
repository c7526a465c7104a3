"""Strain of a rope from its tension, and its derivatives by the law's parameters (IPAnema paper,
Eq. 4 to 6, re-based to no strain at no tension)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array

__all__ = ["LAWS", "LawParameter", "strain_of"]

_NEWTON_STEPS = 30
_SOFTEST = 0.1


@dataclass(frozen=True)
class LawParameter:
    """One number of a law, as it is fitted."""

    name: str
    unit: str
    start: float
    std: float
    low: float = -np.inf
    high: float = np.inf
    reciprocal: bool = False
    """Files have 1/value: a stiffness is fitted as a compliance."""


LAWS: dict[str, tuple[LawParameter, ...]] = {
    "cable-elongation-linear": (
        LawParameter("axial_stiffness", "N", 0.0, 2e-5, 0.0, 1e-3, reciprocal=True),
    ),
    "cable-elongation-quartic": (
        LawParameter("k1", "N", 0.0, 2e-5, 0.0, 1e-3, reciprocal=True),
        LawParameter("b2", "1", 0.0, 100.0),
        LawParameter("b3", "1", 0.0, 3e4),
        LawParameter("b4", "1", 0.0, 1e7),
    ),
    "cable-elongation-exponential": (
        LawParameter("strain_scale", "1", 0.0, 2e-3, 0.0, 0.2),
        LawParameter("force_scale", "N", 200.0, 100.0, 1.0, 1e6),
    ),
}
"""Effects of the catalogue that a robot's calibration can fit, one law for all ropes."""


def strain_of(law: str, values: Array, tension: Array) -> tuple[Array, Array]:
    """Strain at tensions (...), and its derivatives by the law's parameters, (..., m).

    A slack rope has no strain.
    """
    force = np.maximum(tension, 0.0)
    if law == "cable-elongation-linear":
        return values[0] * force, force[..., None]
    if law == "cable-elongation-exponential":
        scale, origin = values
        tight = np.log1p(force / origin)
        slope = -scale * force / (origin * (origin + force))
        return scale * tight, np.stack([tight, slope], axis=-1)
    return _quartic(values, force)


def _quartic(values: Array, force: Array) -> tuple[Array, Array]:
    """ε with c T = ε + b2 ε² + b3 ε³ + b4 ε⁴; its slope is kept from falling below a tenth."""
    compliance, b2, b3, b4 = values
    goal = compliance * force
    strain = goal.copy()
    for _ in range(_NEWTON_STEPS):
        rate = np.maximum(1 + strain * (2 * b2 + strain * (3 * b3 + strain * 4 * b4)), _SOFTEST)
        step = (strain * (1 + strain * (b2 + strain * (b3 + strain * b4))) - goal) / rate
        strain = np.maximum(strain - step, 0.0)
        if np.all(np.abs(step) <= 1e-14):
            break
    by = np.stack([force, -(strain**2), -(strain**3), -(strain**4)], axis=-1)
    return strain, by / rate[..., None]
