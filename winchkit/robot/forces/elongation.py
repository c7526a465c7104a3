"""Strain of a cable from its tension, and its derivatives by the law's parameters.

The laws are Eq. 4 to 6 of the IPAnema paper, with no strain at no tension:

* linear: ε = c T, with the compliance c;
* quartic: ε + b₂ ε² + b₃ ε³ + b₄ ε⁴ = c T;
* exponential: ε = s ln(1 + T/T₀), with a scale of strain s and one of force T₀.
"""

from __future__ import annotations

import numpy as np

from winchkit.arrays import Array

_NEWTON_STEPS = 30
"""At the least slope an error falls by a constant factor only, else quadratically: bound of the
time, not of the accuracy."""
_LEAST_SLOPE = 0.1
"""Least slope d(c T)/dε of the quartic law in Newton's method: beyond it the law turns over."""


def strain_of(law: str, values: Array, tension: Array) -> tuple[Array, Array]:
    """Strain at tensions, N, zero of a slack cable, and its derivatives by the law's ``values``
    (m,), in the last axis: c; c, b₂, b₃, b₄; or s, T₀."""
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
    """Newton's method from the linear law."""
    compliance, b2, b3, b4 = values
    goal = compliance * force
    strain = goal.copy()
    for _ in range(_NEWTON_STEPS):
        slope = 1 + strain * (2 * b2 + strain * (3 * b3 + strain * 4 * b4))
        slope = np.maximum(slope, _LEAST_SLOPE)
        step = (strain * (1 + strain * (b2 + strain * (b3 + strain * b4))) - goal) / slope
        strain = np.maximum(strain - step, 0.0)
        if np.all(np.abs(step) <= 1e-14):
            break
    by = np.stack([force, -(strain**2), -(strain**3), -(strain**4)], axis=-1)
    return strain, by / slope[..., None]
