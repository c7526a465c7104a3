"""exit-point: the exit point of a cable differs from the profile."""

from dataclasses import replace

import numpy as np

from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, LinePlace, Stage


def apply(place: LinePlace, at: At, values: Values) -> LinePlace:
    """A line whose exit point is shifted."""
    shift = np.array([values["x"], values["y"], values["z"]])
    return replace(place, exit_point=place.exit_point + shift)


EFFECT = Effect(
    id="exit-point",
    stage=Stage.LINE_PLACE,
    parameters=tuple(
        Parameter(axis, "m", null=0.0, typical=3e-3, low=-0.2, high=0.2) for axis in "xyz"
    ),
    apply=apply,
    outputs=("cable_length",),
    variable="pose",
    what="The exit point of the cable differs from the profile: a pulley mounted with an offset.",
    formula="p + δp",
    source="CABTIVE paper, Tables 2 and 5 (up to 10 mm apart, nominal to calibrated)",
    looks_like="One line's length error by the cable direction in the base frame, at any tension.",
    confused_with=("anchor-point", "home-length", "swivel-radius"),
    told_apart="Poses that turn the platform: they move anchor points and no exit point.",
    needs=("robot",),
    on_robot=frozenset({"one"}),
)
