"""Scaling of an instrument's value by the host: calibration, then tare.

Zero and tare of the device are in the device, the calibration is in a file, the tare of the host is
here: they are independent of each other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class HostScale:
    """True value from the indicated one: c0 + c1 x + c2 x^2 ..., less the tare. SI."""

    coefficients: tuple[float, ...] = (0.0, 1.0)
    tare: float = 0.0

    def calibrated(self, indicated: float) -> float:
        """True value for an indicated one."""
        value = 0.0
        for coefficient in reversed(self.coefficients):
            value = value * indicated + coefficient
        return value

    def indicated(self, calibrated: float) -> float:
        """Indication of the device for a true value; the inverse of :meth:`calibrated`.

        Of the two a parabola has, the one on its rising side is meant.
        """
        c0, c1, *rest = self.coefficients
        c2 = rest[0] if rest else 0.0
        root = math.sqrt(max(0.0, c1 * c1 - 4 * c2 * (c0 - calibrated)))
        return 2 * (calibrated - c0) / (c1 + root)

    def apply(self, value: float, gross: float) -> tuple[float, float]:
        """Net and gross value from the net and gross value that the device indicates.

        Where the device itself has a tare, its net value is the difference of two calibrated
        ones: a calibration that is not a straight line through zero belongs to gross values.
        """
        calibrated = self.calibrated(gross)
        taken_off = self.calibrated(gross - value) if value != gross else 0.0
        return calibrated - taken_off - self.tare, calibrated
