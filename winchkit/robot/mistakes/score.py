"""Score tests: how far one more number beside a linearised fit would lower χ².

With the residuals e and the number's column z, both without what the poses explain, F the same of
the parameters' columns, H the information with the priors and g the gradient,

    N = z·e − (Fᵀz)ᵀ H⁻¹ g,    D = z·z − (Fᵀz)ᵀ H⁻¹ (Fᵀz),    estimate N / D,  fall N² / D.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array
from winchkit.robot.identification.bundle_adjustment import ReducedEquations

_OWN = 1e-6
"""Share of a column's square below which parameters explain it: it has no number of its own."""


@dataclass(frozen=True)
class Eliminated:
    """A linearised fit without what poses and parameters explain."""

    residual: Array
    """Without what the poses explain, (p, r)."""
    half: Array
    """Columns of the poses, orthonormal, (p, 6, r)."""
    inverse: Array
    """H⁻¹, (q, q)."""
    pull: Array
    """H⁻¹ g, (q,)."""
    square: float
    """χ² with the priors, at its minimum."""
    freedom: float
    """Degrees of freedom."""

    def fall(self, product: Array, own: Array, across: Array) -> tuple[Array, Array]:
        """Estimates and falls of χ² of numbers with these z·e and z·z, (...), and Fᵀz, (..., q);
        zero where parameters explain the column."""
        square = own - np.einsum("...q,qk,...k->...", across, self.inverse, across)
        known = square > _OWN * own
        estimate = np.where(known, product - across @ self.pull, 0.0) / np.where(known, square, 1.0)
        return estimate, estimate**2 * np.where(known, square, 0.0)

    def chance(self, fall: float, trials: int) -> float:
        """Probability of such a fall by chance in one of so many trials (F test)."""
        from scipy.special import fdtrc

        rest = max(self.square - fall, np.finfo(float).eps * self.square)
        if not self.freedom > 1 or not rest > 0:
            return 1.0
        return trials * float(fdtrc(1, self.freedom - 1, (self.freedom - 1) * fall / rest))


def eliminated(linear: ReducedEquations) -> Eliminated:
    """What a linearised fit leaves."""
    stack = linear.stack
    half = linear.factor @ np.swapaxes(stack.by_pose, 1, 2)
    residual = stack.residual[..., None]
    free = (residual - np.swapaxes(half, 1, 2) @ (half @ residual))[..., 0]
    inverse = np.asarray(np.linalg.inv(linear.information + np.eye(len(linear.gradient))))
    pull = inverse @ linear.gradient
    square = float(np.sum(free**2) + linear.prior @ linear.prior - linear.gradient @ pull)
    freedom = float(np.count_nonzero(stack.known) - np.sum(half**2))
    freedom -= float(np.sum(linear.information * inverse))
    return Eliminated(free, half, inverse, pull, square, freedom)
