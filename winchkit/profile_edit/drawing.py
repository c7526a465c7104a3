"""Values of a winch's drawing: the one list that ``winchkit profile new`` and the page ask for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from winchkit.schema.profiles.winch import LAYERED, SHORTHANDS

DRUMS: Mapping[str, str] = {
    "spiral": "one turn on top of the other between narrow flanges; the radius steps once a turn",
    "archimedean": "as spiral, but the radius grows evenly with the angle",
    "grooved": "one layer side by side in a helical groove; the radius is constant",
    "squared": "many turns side by side in each layer; the square of the radius grows with the "
    "length",
}
"""How the cable lies on the drum, by kind."""


@dataclass(frozen=True)
class Field:
    """A value of a winch's drawing."""

    key: str
    """In the profile: table and name."""
    words: str
    example: str
    without: str = ""
    """What the model does where it is unknown; empty: it is needed."""
    drums: tuple[str, ...] = tuple(DRUMS)
    """Kinds of drum that have it."""
    after: str = ""
    """Field without which it has no meaning."""

    @property
    def place(self) -> tuple[str, str]:
        """Table and name."""
        table, _, name = self.key.partition(".")
        return table, name

    @property
    def option(self) -> str:
        """On the command line."""
        return "--" + self.key.replace(".", "-").replace("_", "-")


def _found_as(key: str, without: str) -> str:
    return f"{without}; a diagnosis names it as {SHORTHANDS[key]}"


_LAYERED = tuple(kind for kind in DRUMS if kind in LAYERED)

FIELDS: tuple[Field, ...] = (
    Field("drum.kind", "how the cable lies on the drum", "spiral"),
    Field("drum.winding_radius", "drum axis to cable centre in the first layer", "60 mm"),
    Field("drum.groove_pitch", "distance from groove to groove", "5 mm", drums=("grooved",)),
    Field(
        "drum.build_up",
        "(R² − r²) / L, with the length L on the full drum and its radius R",
        "0.05 mm",
        drums=("squared",),
    ),
    Field(
        "cable.diameter",
        "diameter of the cable",
        "4 mm",
        "not needed where the layer growth is known",
    ),
    Field(
        "drum.layer_growth",
        "radius that one turn on top of another adds",
        "3.8 mm",
        "the cable's diameter is taken; a diagnosis corrects it as layer-thickness",
        drums=_LAYERED,
    ),
    Field("gearbox.ratio", "motor turns per drum turn; 1 for a direct drive", "20.4"),
    Field(
        "gearbox.direction",
        "1 where a growing motor angle winds in, −1 where it pays out",
        "1",
        "1 is taken; a diagnosis reports an inverted sign",
    ),
    Field(
        "gearbox.efficiency",
        "output power over input power of the gearbox",
        "0.9",
        _found_as("gearbox.efficiency", "no losses"),
    ),
    Field(
        "motor.inertia",
        "inertia of rotor and gearbox at the motor",
        "1.2 kg cm^2",
        _found_as("motor.inertia", "no torque for acceleration"),
    ),
    Field(
        "motor.torque_constant",
        "torque per current, for runs that have the current instead of the torque",
        "0.1 N m/A",
        "a run with a current only has no torque to compare",
    ),
    Field(
        "cable.axial_stiffness",
        "force per relative elongation, E A",
        "400 kN",
        _found_as("cable.axial_stiffness", "the cable does not stretch"),
    ),
    Field(
        "cable.mass_per_length",
        "mass of a metre of cable",
        "60 g/m",
        _found_as("cable.mass_per_length", "the cable has no weight"),
    ),
    Field(
        "cable.dead_length",
        "stressed cable between drum and exit point",
        "1.5 m",
        "0 m is taken; it stretches with the free cable",
    ),
    Field(
        "path.inclination",
        "angle of the free cable to the horizontal",
        "90 deg",
        "90 deg is taken: the cable hangs",
    ),
    Field(
        "guide.screw_lead",
        "travel of the cable guide per turn of its screw",
        "5 mm",
        "no cable guide",
    ),
    Field(
        "guide.belt_ratio",
        "screw turns per drum turn",
        "1",
        "1 is taken",
        after="guide.screw_lead",
    ),
    Field(
        "guide.distance",
        "from the drum to the guide",
        "0.4 m",
        "0.4 m is taken",
        after="guide.screw_lead",
    ),
    Field(
        "reference.cable_length",
        "free cable where the motor angle is zero",
        "4 m",
        "runs that measure the length give it; without them how much cable stretches is unknown; "
        "a move to a length is not possible",
    ),
    Field(
        "reference.wound_turns",
        "turns on the drum where the motor angle is zero",
        "4",
        "0 is taken; a diagnosis names missing layers as drum-radius",
    ),
)
"""In the order in which they are asked."""
PULLEY = "radius and wrap angle of each pulley, from the drum to the load"
"""What is asked for every pulley."""
PULLEY_EXAMPLE = "40 mm, 90 deg"
NO_PULLEY = "none: friction and inertia of pulleys are not considered"
"""What the model does without pulleys."""


def asked(values: Mapping[str, str]) -> list[Field]:
    """Fields that a winch of the given values has, in order; of an unknown drum those of all."""
    kinds = {values.get("drum.kind", "")} & {*DRUMS} or {*DRUMS}
    return [
        field
        for field in FIELDS
        if kinds <= {*field.drums} and (not field.after or values.get(field.after))
    ]
