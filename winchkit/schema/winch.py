"""What a profile of a winch declares: drum, gearbox, guide, rope, pulleys, reference, effects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import pi
from typing import Annotated, Any, Literal

from winchkit.schema.quantity import (
    Angle,
    Count,
    Length,
    LinearDensity,
    PositiveForce,
    PositiveLength,
    PositiveNumber,
    Quantity,
)

__all__ = [
    "CableSpec",
    "DrumSpec",
    "EffectTable",
    "GearboxSpec",
    "GuideSpec",
    "PathSpec",
    "PulleySpec",
    "ReferenceSpec",
    "WinchProfile",
]


@dataclass(frozen=True)
class DrumSpec:
    """The drum; which of the optional numbers count depends on ``kind``."""

    kind: Literal["spiral", "archimedean", "grooved", "squared"]
    winding_radius: PositiveLength
    """Axis to rope centre on the first layer, m."""
    groove_pitch: PositiveLength | None = None
    layer_growth: PositiveLength | None = None
    """Radius gained per turn (spiral, archimedean), m; default is the rope's diameter."""
    build_up: Annotated[float, Quantity("length", 0.0)] | None = None
    """k of r² = r0² + k L (squared): an area per length, m."""


@dataclass(frozen=True)
class CableSpec:
    """The rope."""

    diameter: PositiveLength | None = None
    dead_length: Annotated[float, Quantity("length", 0.0)] = 0.0
    """Stressed rope between drum and exit point, m."""
    axial_stiffness: PositiveForce | None = None
    """Shorthand for the effect cable-elongation-linear, N."""
    mass_per_length: LinearDensity | None = None
    """Shorthand for the effect cable-weight, kg/m."""


@dataclass(frozen=True)
class PathSpec:
    """Where the free rope runs."""

    inclination: Angle = pi / 2
    """Of the free rope against the horizontal, rad; 90 degrees is hanging."""


@dataclass(frozen=True)
class GearboxSpec:
    """The gearbox between motor and drum."""

    ratio: PositiveNumber
    """Motor turns per drum turn."""
    direction: Literal[1, -1] = 1
    efficiency: Annotated[float, Quantity("ratio", 0.0, 1.0, above=True)] | None = None
    """Shorthand for the effect gear-efficiency."""


@dataclass(frozen=True)
class GuideSpec:
    """The lead-screw guide that lays the rope on the drum."""

    screw_lead: PositiveLength
    belt_ratio: PositiveNumber = 1.0
    """Screw turns per drum turn."""
    distance: PositiveLength = 0.4
    """From drum to guide, m."""


@dataclass(frozen=True)
class PulleySpec:
    """One pulley on the rope's way, in order from the drum to the platform."""

    radius: PositiveLength
    wrap: Annotated[float, Quantity("angle", 0.0)] = pi / 2
    """Wrap angle, rad."""


@dataclass(frozen=True)
class ReferenceSpec:
    """The state that every angle and length is counted from."""

    motor_angle: Angle = 0.0
    cable_length: Length | None = None
    """Free length at that motor angle, m; a robot's winches may leave it out."""
    wound_turns: Count = 0.0
    """Turns on the drum at that motor angle."""


@dataclass(frozen=True)
class EffectTable:
    """An ``[[effect]]`` table, unread: the layer ``effects`` binds it, with its line in errors."""

    id: str
    values: Mapping[str, Any]
    path: str = ""
    line: int | None = None


@dataclass(frozen=True)
class WinchProfile:
    """A winch as declared; frozen, SI."""

    name: str
    drum: DrumSpec
    gearbox: GearboxSpec
    reference: ReferenceSpec
    cable: CableSpec = field(default_factory=CableSpec)
    path: PathSpec = field(default_factory=PathSpec)
    guide: GuideSpec | None = None
    pulley: tuple[PulleySpec, ...] = ()
    effect: tuple[EffectTable, ...] = ()
    description: str = ""
