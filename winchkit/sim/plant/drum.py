"""Winding laws of the drum: wound length over the total wound angle, and inverse; plain floats."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from math import floor, hypot, pi, sqrt

from winchkit.errors import UsageError
from winchkit.schema.profiles.winch import WinchProfile

_TURN = 2 * pi
CLIMB = 0.1
"""Angle over which a cable climbs to the next turn of a spiral, rad; zero in Eq. 2."""


class PlantDrum(ABC):
    """Cable on a drum: all angles are the total wound angle in rad, all lengths in m."""

    @abstractmethod
    def wound(self, angle: float) -> tuple[float, float]:
        """Wound length and its derivative by the angle, the winding radius."""

    @abstractmethod
    def angle(self, wound: float) -> float:
        """Wound angle of a wound length."""


@dataclass(frozen=True)
class GrowingDrum(PlantDrum):
    """The radius of every turn is larger by ``growth`` (Eq. 2 of the CABTIVE paper).

    The corner between two turns is rounded over ``climb`` rad, which moves the length by at
    most growth·climb/8; with ``climb = 0`` the law is Eq. 2 itself.
    """

    radius: float
    growth: float
    climb: float = 0.0

    def wound(self, angle: float) -> tuple[float, float]:
        """Wound length and winding radius."""
        turns = floor(angle / _TURN)
        rest = angle - _TURN * turns
        radius = self.radius + turns * self.growth
        whole = _TURN * (turns * self.radius + self.growth * turns * (turns - 1) / 2)
        length = whole + rest * radius
        half = self.climb / 2
        if rest < half:
            depth = half - rest
            return length + self._corner(depth), radius - self.growth * depth / self.climb
        if rest > _TURN - half:
            depth = rest - _TURN + half
            return length + self._corner(depth), radius + self.growth * depth / self.climb
        return length, radius

    def _corner(self, depth: float) -> float:
        return self.growth * depth * depth / (2 * self.climb)

    def angle(self, wound: float) -> float:
        """Wound angle: the whole turns from a quadratic, the rest linear."""
        g, r = self.growth, self.radius
        if g == 0.0:
            return wound / r
        b = r - g / 2
        inside = b * b + g * wound / pi
        if inside < 0:
            raise UsageError(f"no angle winds {wound:g} m on a spiral drum of radius {r:g} m")
        turns = floor((sqrt(inside) - b) / g + 1e-12)
        whole = _TURN * (turns * r + g * turns * (turns - 1) / 2)
        return _TURN * turns + (wound - whole) / (r + turns * g)


@dataclass(frozen=True)
class Growing(PlantDrum):
    """The radius grows in proportion to the angle: archimedean, and r² = r0² + kL."""

    radius: float
    slope: float
    """Radius gained per radian, m."""

    def wound(self, angle: float) -> tuple[float, float]:
        """Wound length and winding radius."""
        radius = self.radius + self.slope * angle
        return angle * (self.radius + radius) / 2, radius

    def angle(self, wound: float) -> float:
        """Wound angle from the quadratic."""
        if self.slope == 0.0:
            return wound / self.radius
        inside = self.radius**2 + 2 * self.slope * wound
        if inside < 0:
            raise UsageError(f"no angle winds {wound:g} m on a drum of radius {self.radius:g} m")
        return (sqrt(inside) - self.radius) / self.slope


def drum_of(profile: WinchProfile, climb: float = 0.0) -> PlantDrum:
    """Build the winding law of a profile; raises UsageError where a number is missing."""
    spec = profile.drum
    if spec.kind == "grooved":
        if spec.groove_pitch is None:
            raise UsageError(f"{profile.name}: drum.groove_pitch is missing for a grooved drum")
        return Growing(hypot(spec.winding_radius, spec.groove_pitch / _TURN), 0.0)
    if spec.kind == "squared":
        if spec.build_up is None:
            raise UsageError(f"{profile.name}: drum.build_up is missing for a squared drum")
        return Growing(spec.winding_radius, spec.build_up / 2)
    growth = spec.layer_growth if spec.layer_growth is not None else profile.cable.diameter
    if growth is None:
        raise UsageError(
            f"{profile.name}: drum.layer_growth (or cable.diameter) is missing "
            f"for a drum of kind {spec.kind}"
        )
    if spec.kind == "spiral":
        return GrowingDrum(spec.winding_radius, growth, climb)
    return Growing(spec.winding_radius, growth / _TURN)
