"""Physics of gearbox, drum and guide."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, hypot, pi, sin
from typing import ClassVar

from winchkit.errors import FileError
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.quantity import Angle, Duration, Length, PositiveNumber, Ratio, Torque
from winchkit.sim.physics.base import Physics, PlantState, motor_direction

_SLIP_TIME = 0.4
"""s: short against a stroke, many steps of the integration."""


@dataclass
class FatDrum(Physics):
    """The drum's radius is larger than declared."""

    radius_error: Length = 0.00015

    def reshape(self, profile: WinchProfile) -> WinchProfile:
        radius = profile.drum.winding_radius + self.radius_error
        return replace(profile, drum=replace(profile.drum, winding_radius=radius))


@dataclass
class WrongRatio(Physics):
    """The gearbox has another ratio than declared."""

    ratio_error: Ratio = 0.004

    def reshape(self, profile: WinchProfile) -> WinchProfile:
        ratio = profile.gearbox.ratio * (1 + self.ratio_error)
        return replace(profile, gearbox=replace(profile.gearbox, ratio=ratio))


@dataclass
class ThickLayers(Physics):
    """The growth of the layers on a drum is larger than declared."""

    growth_error: Length = 0.00005

    def reshape(self, profile: WinchProfile) -> WinchProfile:
        """Add the error to the layer growth; FileError on a drum without layers."""
        drum = profile.drum
        growth = drum.layer_growth if drum.layer_growth is not None else profile.cable.diameter
        if drum.kind not in ("spiral", "archimedean") or growth is None:
            raise FileError(f"hidden 'thick layers': a {drum.kind} drum has no layers")
        return replace(profile, drum=replace(drum, layer_growth=growth + self.growth_error))


@dataclass
class EccentricDrum(Physics):
    """Runout of the drum: one period per turn in length and torque arm."""

    eccentricity: Length = 0.0005
    phase: Angle = 0.7

    def wound_length(self, state: PlantState) -> tuple[float, float]:
        """Sine of the drum angle, zero at the reference."""
        angle = state.drum_angle - self.phase
        extra = self.eccentricity * (sin(angle) + sin(self.phase))
        return extra, self.eccentricity * cos(angle)


@dataclass
class GuideOffset(Physics):
    """Axial offset of the guide from the winding point, which makes the cable path longer."""

    offset: Length = 0.03
    mismatch: Length = 0.002
    """Sideways per drum turn, m."""
    size: ClassVar[str] = "mismatch"
    _distance: float = 0.4

    def begin(self, profile: WinchProfile) -> None:
        """Take the guide's distance; FileError without a guide."""
        if profile.guide is None:
            raise FileError(f"hidden 'guide offset': {profile.name} has no guide")
        self._distance = profile.guide.distance

    def wound_length(self, state: PlantState) -> tuple[float, float]:
        per_radian = self.mismatch / (2 * pi)
        aside = self.offset + per_radian * state.wound_angle
        slant = hypot(self._distance, aside)
        return slant - self._distance, aside / slant * per_radian


@dataclass
class WavyGear(Physics):
    """Transmission error of the gearbox, a whole number of periods per motor turn."""

    amplitude: Angle = 0.0002
    order: PositiveNumber = 1.0
    phase: Angle = 0.4
    _ratio: float = 1.0

    def begin(self, profile: WinchProfile) -> None:
        self._ratio = profile.gearbox.ratio * profile.gearbox.direction

    def drum_angle(self, state: PlantState, dt: float) -> tuple[float, float, float]:
        angle = self.order * state.motor_angle + self.phase
        slope = self.amplitude * self.order * cos(angle) * self._ratio
        return self.amplitude * sin(angle), slope, 0.0


@dataclass
class Slip(Physics):
    """A single slip of the encoder's coupling."""

    step: Angle = 0.03
    time: Duration = 5.0

    def drum_angle(self, state: PlantState, dt: float) -> tuple[float, float, float]:
        """A smooth step that takes 0.4 s."""
        x = (state.time - self.time) / _SLIP_TIME
        if x <= 0.0:
            return 0.0, 0.0, 0.0
        if x >= 1.0:
            return self.step, 0.0, 0.0
        rate = self.step * 6 * x * (1 - x) / _SLIP_TIME
        return self.step * x * x * (3 - 2 * x), 0.0, rate


@dataclass
class LooseGear(Physics):
    """Backlash: the drum rests within the gap while its friction exceeds the load torque.

    With a lower friction the teeth stay on one flank, and the backlash has no effect. The friction
    adds to the motor torque.
    """

    gap: Angle = 0.01
    drag: Torque = 30.0
    """Friction torque at the drum, N m."""
    _ratio: float = 1.0
    _radius: float = 0.0
    _drum: float | None = None

    def begin(self, profile: WinchProfile) -> None:
        self._ratio = profile.gearbox.ratio
        self._radius = profile.drum.winding_radius

    def drum_angle(self, state: PlantState, dt: float) -> tuple[float, float, float]:
        driven = state.drum_angle
        half = self.gap / 2
        if self._drum is None:
            self._drum = driven
        low = high = driven - half
        if state.load * self._radius <= self.drag:
            high = driven + half
        inside = low < self._drum < high
        self._drum = min(max(self._drum, low), high)
        return self._drum - driven, -1.0 if inside else 0.0, 0.0

    def gear(self, state: PlantState, torque: float) -> float:
        return torque + motor_direction(state) * self.drag / self._ratio
