"""Rope wound since home as a linear function of winding radius and growth, for all drums at once.

At a given angle every winding law of the drums is linear in its growth, and all but the helix in
its radius, so the angles need be looked at only once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from winchkit.model.drum import Archimedean, Grooved, Spiral, Squared, drum_of
from winchkit.schema.winch import WinchProfile

__all__ = ["Winding", "winding_of"]

Array = NDArray[np.float64]
_TURN = 2 * np.pi


@dataclass(frozen=True)
class Winding:
    """ΔW = √(r² + lead²) Δφ + g gain + rest, all (p, n) but the lead, which is (n,)."""

    turned: Array
    """Drum angle since home, rad."""
    gain: Array
    """ΔW by the layer growth; zero where a drum has none."""
    rest: Array
    """What neither radius nor growth changes, m."""
    lead: Array
    """Groove pitch over a turn, m/rad."""

    def wound(self, radius: Array, growth: float) -> Array:
        """Rope wound in since home, (p, n), m."""
        return np.hypot(radius, self.lead) * self.turned + growth * self.gain + self.rest

    def by_radius(self, radius: Array) -> Array:
        """Its derivative by the lines' winding radii, (p, n)."""
        return radius / np.hypot(radius, self.lead) * self.turned


def winding_of(winches: Sequence[WinchProfile], motor_angle: Array) -> Winding:
    """Drum angles and what winds by them, from motor angles (p, n), rad."""
    turned, gain, rest = (np.zeros_like(motor_angle) for _ in range(3))
    lead = np.zeros(len(winches))
    for i, winch in enumerate(winches):
        ratio = winch.gearbox.direction * winch.gearbox.ratio
        home = np.asarray(_TURN * winch.reference.wound_turns)
        turned[:, i] = (motor_angle[:, i] - winch.reference.motor_angle) / ratio
        angle = home + turned[:, i]
        match drum_of(winch):
            case Spiral():
                unit: Spiral | Archimedean = Spiral(0.0, 1.0)
                gain[:, i] = unit.wound(angle) - unit.wound(home)
            case Archimedean():
                unit = Archimedean(0.0, 1.0)
                gain[:, i] = unit.wound(angle) - unit.wound(home)
            case Squared(_, build_up):
                unit = Archimedean(0.0, np.pi * build_up)
                rest[:, i] = unit.wound(angle) - unit.wound(home)
            case Grooved(_, pitch):
                lead[i] = pitch / _TURN
    return Winding(turned, gain, rest, lead)
