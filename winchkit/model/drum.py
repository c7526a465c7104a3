"""Drums: wound length, torque arm and their closed-form inverse, for four winding laws.

Angles are the total wound angle Φ in rad, lengths in m, arrays of any shape. Below Φ = 0 the
first layer's radius applies, so that a cable that is paid out too far still has a defined length.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from winchkit.arrays import Array
from winchkit.schema.profiles.winch import WinchProfile

_TURN = 2 * np.pi


class Drum(Protocol):
    """A winding law W(Φ) with its derivative and inverse."""

    @property
    def winding_radius(self) -> float:
        """Axis to cable centre on the first layer, m."""

    def wound(self, angle: Array) -> Array:
        """Length on the drum at the wound angle, m."""

    def arm(self, angle: Array) -> Array:
        """dW/dΦ, the torque arm at the wound angle, m."""

    def angle(self, length: Array) -> Array:
        """Wound angle at which ``length`` is on the drum, rad."""


@dataclass(frozen=True)
class Spiral:
    """Layers of whole turns, the radius stepping once a turn (CABTIVE paper, Eq. 2)."""

    winding_radius: float
    growth: float
    """Radius gained per layer, m."""

    def _layer(self, angle: Array) -> Array:
        return np.maximum(np.floor(angle / _TURN), 0.0)

    def _full(self, layers: Array) -> Array:
        return _TURN * layers * (self.winding_radius + self.growth * (layers - 1) / 2)

    def wound(self, angle: Array) -> Array:
        """(Φ − 2πn)(r + n g) + 2π(n r + g n(n − 1)/2), n whole turns."""
        n = self._layer(angle)
        return (angle - _TURN * n) * (self.winding_radius + n * self.growth) + self._full(n)

    def arm(self, angle: Array) -> Array:
        """Radius of the layer being wound, m."""
        return self.winding_radius + self._layer(angle) * self.growth

    def angle(self, length: Array) -> Array:
        """Inverse: whole layers from a quadratic, the rest on the layer's own radius."""
        half = self.winding_radius - self.growth / 2
        turns = np.maximum(length, 0.0) / _TURN
        root = 2 * turns / (half + np.sqrt(half**2 + 2 * self.growth * turns))
        # Within rounding of a whole turn both layers give the same length.
        n = np.floor(root + 1e-12)
        return _TURN * n + (length - self._full(n)) / (self.winding_radius + n * self.growth)


@dataclass(frozen=True)
class Archimedean:
    """The radius grows in proportion to the angle: W = r Φ + g Φ²/4π."""

    winding_radius: float
    growth: float
    """Radius gained per turn, m."""

    def wound(self, angle: Array) -> Array:
        """R Φ + g Φ²/4π; on the first radius below zero."""
        # Multiplied out, since numpy's power rounds arrays and single numbers differently.
        wound = np.maximum(angle, 0.0)
        return self.winding_radius * angle + self.growth * wound * wound / (2 * _TURN)

    def arm(self, angle: Array) -> Array:
        """R + g Φ/2π."""
        return self.winding_radius + self.growth * np.maximum(angle, 0.0) / _TURN

    def angle(self, length: Array) -> Array:
        """Inverse by the quadratic, in the form that stays exact for g → 0."""
        radius = self.winding_radius
        square = radius**2 + self.growth * np.maximum(length, 0.0) / np.pi
        return 2 * length / (radius + np.sqrt(square))


@dataclass(frozen=True)
class Grooved:
    """One layer in a helical groove: W = Φ √(r² + (pitch/2π)²)."""

    winding_radius: float
    pitch: float
    """Groove pitch, m a turn."""

    @property
    def _per_radian(self) -> float:
        return float(np.hypot(self.winding_radius, self.pitch / _TURN))

    def wound(self, angle: Array) -> Array:
        """Helix length."""
        return angle * self._per_radian

    def arm(self, angle: Array) -> Array:
        """Constant."""
        return np.full_like(angle, self._per_radian, dtype=float)

    def angle(self, length: Array) -> Array:
        """Inverse."""
        return length / self._per_radian


@dataclass(frozen=True)
class Squared:
    """Radius by the volume of the cable: r² = r0² + k W, hence W = r0 Φ + k Φ²/4."""

    winding_radius: float
    build_up: float
    """k, an area per length, m."""

    @property
    def _even(self) -> Archimedean:
        # r0 Φ + k Φ²/4 is the Archimedean law with g = π k.
        return Archimedean(self.winding_radius, np.pi * self.build_up)

    def wound(self, angle: Array) -> Array:
        """R0 Φ + k Φ²/4."""
        return self._even.wound(angle)

    def arm(self, angle: Array) -> Array:
        """R0 + k Φ/2."""
        return self._even.arm(angle)

    def angle(self, length: Array) -> Array:
        """Inverse."""
        return self._even.angle(length)


def drum_of(profile: WinchProfile) -> Spiral | Archimedean | Grooved | Squared:
    """The winding law that a profile declares; its layers grow by the cable diameter by default."""
    spec = profile.drum
    growth = spec.layer_growth if spec.layer_growth is not None else profile.cable.diameter
    match spec.kind:
        case "spiral":
            return Spiral(spec.winding_radius, growth or 0.0)
        case "archimedean":
            return Archimedean(spec.winding_radius, growth or 0.0)
        case "grooved":
            return Grooved(spec.winding_radius, spec.groove_pitch or 0.0)
        case "squared":
            return Squared(spec.winding_radius, spec.build_up or 0.0)
