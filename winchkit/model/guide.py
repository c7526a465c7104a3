"""The lead-screw guide that lays the rope on the drum: its travel, its miss, the fleet angle.

Angles are the total wound angle Φ in rad, lengths in m; arrays of any shape.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import ArrayLike, NDArray

from winchkit.errors import UsageError
from winchkit.schema.winch import WinchProfile

__all__ = ["FLEET_LIMIT", "Guide", "guide_of"]

Array = NDArray[np.float64]
_TURN = 2 * pi
FLEET_LIMIT = {"grooved": np.deg2rad(2.0), "smooth": np.deg2rad(1.5)}
"""Fleet angle up to which a rope lies well, rad: what rope makers' handbooks ask for."""


@dataclass(frozen=True)
class Guide:
    """A nut on a screw that a belt drives from the drum."""

    screw_lead: float
    """m per screw turn."""
    belt_ratio: float = 1.0
    """Screw turns per drum turn."""
    distance: float = 0.4
    """From drum to guide, m."""
    pitch: float | None = None
    """What the rope needs per drum turn, m: the groove's pitch; None on a drum of one lane."""

    @property
    def lead(self) -> float:
        """What the guide moves per drum turn, m."""
        return self.screw_lead * self.belt_ratio

    @property
    def mismatch(self) -> float:
        """What the guide gains on the groove per drum turn, m."""
        return self.lead - (self.pitch or 0.0)

    def position(self, angle: ArrayLike) -> Array:
        """Way of the guide since an empty drum, m."""
        return np.asarray(angle, dtype=float) * (self.lead / _TURN)

    def aside(self, angle: ArrayLike, offset: float = 0.0) -> Array:
        """How far the guide stands beside the place where the rope winds, m."""
        return offset + np.asarray(angle, dtype=float) * (self.mismatch / _TURN)

    def fleet_angle(self, angle: ArrayLike, offset: float = 0.0) -> Array:
        """Between the rope and the plane square to the drum's axis, signed, rad."""
        return np.arctan2(self.aside(angle, offset), self.distance)

    def turns_within(self, fleet_angle: float, offset: float = 0.0) -> float:
        """Drum turns from an empty drum until the fleet angle passes a limit (rad); inf: never."""
        reach = self.distance * np.tan(fleet_angle)
        if abs(offset) > reach:
            return 0.0
        if self.mismatch == 0.0:
            return float("inf")
        return float((reach - np.sign(self.mismatch) * offset) / abs(self.mismatch))

    def turns_in(self, travel: float) -> float:
        """Drum turns that a travel of the nut (m) allows."""
        return travel / self.lead

    def check(self, angle: float, travel: float) -> None:
        """Raise UsageError where the guide would be driven beyond its ``travel`` (m)."""
        there = float(self.position(angle))
        if not 0.0 <= there <= travel:
            raise UsageError(
                f"the guide would stand at {there * 1e3:.1f} mm of its 0 to {travel * 1e3:.1f} mm "
                f"with {angle / _TURN:.2f} turns on the drum; wind at most "
                f"{self.turns_in(travel):.2f} turns"
            )


def guide_of(profile: WinchProfile) -> Guide:
    """The guide of a profile. Raises UsageError where it has none."""
    spec = profile.guide
    if spec is None:
        raise UsageError(f"the winch '{profile.name}' has no [guide]; add one with its screw_lead")
    return Guide(spec.screw_lead, spec.belt_ratio, spec.distance, profile.drum.groove_pitch)
