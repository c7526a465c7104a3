"""Contents of a winch profile: drum, gearbox, guide, cable, pulleys, reference, effects."""

from __future__ import annotations

import datetime
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import pi
from typing import Annotated, Any, Literal

from winchkit.rendering import Plotted
from winchkit.schema.profiles.control import ControlSpec
from winchkit.schema.quantity import (
    Angle,
    Count,
    Inertia,
    LinearDensity,
    PositiveForce,
    PositiveLength,
    Quantity,
)
from winchkit.schema.table import Rule, Table


@dataclass(frozen=True)
class LedgerEntry(Table):
    """One step: an effect added or removed, its held-out errors, and the data to undo it."""

    did: Literal["add", "remove"]
    effect: str
    date: datetime.date
    runs: tuple[str, ...] = ()
    before: Mapping[str, str] = field(default_factory=dict)
    """Held-out error per output before the step, rms with its unit."""
    after: Mapping[str, str] = field(default_factory=dict)
    noise: Mapping[str, str] = field(default_factory=dict)
    was: tuple[Mapping[str, Any], ...] = ()
    """The ``[[effect]]`` tables before the step, in order."""
    shorthand: Mapping[str, Any] = field(default_factory=dict)
    """Shorthand keys such as ``cable.axial_stiffness`` as they were before the step."""


LAYERED = frozenset({"spiral", "archimedean"})
"""Kinds of drum with layers."""

SHORTHANDS: dict[str, str] = {
    "cable.axial_stiffness": "cable-elongation-linear",
    "cable.mass_per_length": "cable-weight",
    "gearbox.efficiency": "gear-efficiency",
    "motor.inertia": "rotor-inertia",
}
"""Profile keys that are equivalent to an effect."""


@dataclass(frozen=True)
class DrumSpec(Table):
    """The drum; ``kind`` determines which of the optional numbers apply."""

    kind: Literal["spiral", "archimedean", "grooved", "squared"]
    winding_radius: PositiveLength
    """Axis to cable centre on the first layer, m."""
    groove_pitch: Annotated[float, Quantity("length", 0.0)] | None = None
    """Of a grooved drum, m a turn."""
    layer_growth: Annotated[float, Quantity("length", 0.0)] | None = None
    """Radius gained per turn (spiral, archimedean), m; default is the cable's diameter."""
    build_up: Annotated[float, Quantity("length", 0.0)] | None = None
    """k of r² = r0² + k L (squared): an area per length, m."""
    width: PositiveLength | None = None
    """Between the flanges, m; with ``groove_pitch`` it determines the capacity in turns."""
    flange_radius: PositiveLength | None = None
    """Axis to the flange's rim, m; determines the capacity in layers."""

    def rules(self) -> Iterator[Rule]:
        """A grooved drum needs its pitch, a squared one its build-up."""
        needed = {"grooved": "groove_pitch", "squared": "build_up"}.get(self.kind)
        if needed and getattr(self, needed) is None:
            yield needed, f"missing; a {self.kind} drum needs it"
        if self.build_up is not None and self.kind != "squared":
            yield "build_up", f"belongs to a squared drum, not to a {self.kind} one"
        if self.layer_growth is not None and self.kind not in LAYERED:
            yield ("layer_growth", f"belongs to a layered drum, not to a {self.kind} one")
        if self.flange_radius is not None and self.flange_radius <= self.winding_radius:
            yield (
                "flange_radius",
                f"{self.flange_radius:g} m must be above winding_radius {self.winding_radius:g} m",
            )


@dataclass(frozen=True)
class CableSpec(Table):
    """The cable."""

    diameter: PositiveLength | None = None
    dead_length: Annotated[float, Quantity("length", 0.0)] = 0.0
    """Stressed cable between drum and exit point, m."""
    axial_stiffness: PositiveForce | None = None
    """Shorthand for the effect cable-elongation-linear, N."""
    mass_per_length: LinearDensity | None = None
    """Shorthand for the effect cable-weight, kg/m."""


@dataclass(frozen=True)
class PathSpec(Table):
    """Direction of the free cable."""

    inclination: Annotated[
        float, Quantity("angle", -pi, pi, why="it is an angle to the horizontal")
    ] = pi / 2
    """Angle of the free cable to the horizontal, rad; 90 degrees is hanging."""


@dataclass(frozen=True)
class GearboxSpec(Table):
    """The gearbox between motor and drum."""

    ratio: Annotated[
        float, Quantity("number", 1e-3, 1e5, why="gearboxes of winches have 1 to some thousands")
    ] = 1.0
    """Motor turns per drum turn; 1 is a direct drive."""
    direction: Literal[1, -1] = 1
    efficiency: Annotated[float, Quantity("ratio", 0.0, 1.0, above=True)] | None = None
    """Shorthand for the effect gear-efficiency."""


@dataclass(frozen=True)
class MotorSpec(Table):
    """The motor."""

    inertia: Inertia | None = None
    """Shorthand for the effect rotor-inertia: rotor and gearbox, at the motor, kg m²."""
    torque_constant: Annotated[float, Quantity("torque per current", 0.0, above=True)] | None = None
    """Torque per current, N m/A, for runs that have the current in place of the torque."""


@dataclass(frozen=True)
class GuideSpec(Table):
    """The lead-screw guide that lays the cable on the drum."""

    screw_lead: PositiveLength
    belt_ratio: Annotated[
        float, Quantity("number", 1e-3, 1e3, why="belts of cable guides have some tens at most")
    ] = 1.0
    """Screw turns per drum turn."""
    distance: PositiveLength = 0.4
    """From drum to guide, m."""


@dataclass(frozen=True)
class PulleySpec(Table):
    """One pulley, in order from the drum to the platform."""

    radius: PositiveLength
    wrap: Annotated[float, Quantity("angle", 0.0)] = pi / 2
    """Wrap angle, rad."""


@dataclass(frozen=True)
class ReferenceSpec(Table):
    """Reference state of all angles and lengths."""

    motor_angle: Angle = 0.0
    cable_length: Annotated[float, Quantity("length", 0.0)] | None = None
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


@dataclass(frozen=True, repr=False)
class WinchProfile(Plotted, Table):
    """A winch as declared; frozen, SI."""

    name: str
    drum: DrumSpec
    reference: ReferenceSpec
    gearbox: GearboxSpec = field(default_factory=GearboxSpec)
    cable: CableSpec = field(default_factory=CableSpec)
    path: PathSpec = field(default_factory=PathSpec)
    motor: MotorSpec = field(default_factory=MotorSpec)
    control: ControlSpec | None = None
    guide: GuideSpec | None = None
    pulley: tuple[PulleySpec, ...] = ()
    effect: tuple[EffectTable, ...] = ()
    ledger: tuple[LedgerEntry, ...] = ()
    description: str = ""

    @property
    def is_linear(self) -> bool:
        """Whether it is an axis whose runs have a position and a force."""
        return False

    def rules(self) -> Iterator[Rule]:
        """Layers grow by the cable's diameter by default; a value is given once."""
        drum = self.drum
        if drum.kind in LAYERED and drum.layer_growth is None and self.cable.diameter is None:
            yield (
                "drum.layer_growth",
                f"missing; a {drum.kind} drum needs it, or cable.diameter as its default",
            )
        effects = {table.id for table in self.effect}
        for key, effect in SHORTHANDS.items():
            part, _, name = key.partition(".")
            if getattr(getattr(self, part), name) is not None and effect in effects:
                yield key, f"is shorthand for the effect {effect}, which is given too; keep one"
