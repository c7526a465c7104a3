"""The lead-screw guide that lays the cable on the drum: travel, offset and fleet angle.

Angles are the total wound angle Φ in rad, lengths in m; arrays of any shape.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite, pi

import numpy as np
from numpy.typing import ArrayLike

from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.model.capacity import capacity, turns_at
from winchkit.schema.profiles.winch import WinchProfile

_TURN = 2 * pi
FLEET_LIMIT = {"grooved": np.deg2rad(2.0), "smooth": np.deg2rad(1.5)}
"""Largest recommended fleet angle of a wire rope, rad: 2° on grooves, 1.5° on a smooth drum.

Source: wire rope users' handbooks, e.g. wirerope.net/jrscom/fleet-angle (Fig. 39). Makers differ:
Gover allows 2.5° on grooves, Crane Cables Australia 2° to 4° by the cable's construction.
"""


@dataclass(frozen=True)
class Guide:
    """A nut on a screw that a belt drives from the drum."""

    screw_lead: float
    """Lead of the screw, m per turn."""
    belt_ratio: float = 1.0
    """Screw turns per drum turn."""
    distance: float = 0.4
    """From drum to guide, m."""
    pitch: float | None = None
    """Pitch of the groove, m per drum turn; None on a layered drum."""

    @property
    def lead(self) -> float:
        """Travel of the guide per drum turn, m."""
        return self.screw_lead * self.belt_ratio

    @property
    def mismatch(self) -> float:
        """Travel of the guide less groove pitch, per drum turn, m."""
        return self.lead - (self.pitch or 0.0)

    def position(self, angle: ArrayLike) -> Array:
        """Travel of the guide since an empty drum, m."""
        return np.asarray(angle, dtype=float) * (self.lead / _TURN)

    def aside(self, angle: ArrayLike) -> Array:
        """Axial offset of the guide from the point where the cable winds, m."""
        return np.asarray(angle, dtype=float) * (self.mismatch / _TURN)

    def fleet_angle(self, angle: ArrayLike) -> Array:
        """Angle between the cable and the plane perpendicular to the drum's axis, signed, rad."""
        return np.arctan2(self.aside(angle), self.distance)

    def turns_within(self, fleet_angle: float) -> float:
        """Drum turns from an empty drum until the fleet angle exceeds a limit (rad), or inf."""
        if self.mismatch == 0.0:
            return float("inf")
        return float(self.distance * np.tan(fleet_angle) / abs(self.mismatch))


def guide_of(profile: WinchProfile) -> Guide:
    """The guide of a profile. Raises UsageError where it has none."""
    spec = profile.guide
    if spec is None:
        raise UsageError(f"the winch '{profile.name}' has no [guide]; add one with its screw_lead")
    return Guide(spec.screw_lead, spec.belt_ratio, spec.distance, profile.drum.groove_pitch)


def guide_warnings(
    profile: WinchProfile, shortest: float | None = None
) -> Iterator[tuple[str, str]]:
    """Warnings about a fleet angle beyond the limit on a grooved drum, down to the ``shortest``
    free length, by default of a full drum; the guide is assumed to be above the cable on an empty
    drum."""
    if profile.guide is None or not profile.drum.groove_pitch:
        return
    guide, limit = guide_of(profile), float(FLEET_LIMIT["grooved"])
    full = capacity(profile).turns
    turns = full if isfinite(full) else profile.reference.wound_turns
    if shortest is not None:
        turns = turns_at(profile, shortest)
    reach = guide.turns_within(limit)
    if turns > reach:
        aside = float(guide.aside(_TURN * turns))
        angle = float(np.degrees(guide.fleet_angle(_TURN * turns)))
        yield (
            "guide.screw_lead",
            f"with {turns:.4g} turns on the drum the guide is {aside * 1e3:.1f} mm beside the "
            f"cable, a fleet angle of {angle:.2g} deg; above {np.degrees(limit):g} deg, from "
            f"{reach:.3g} turns on, a cable may leave its groove",
        )
