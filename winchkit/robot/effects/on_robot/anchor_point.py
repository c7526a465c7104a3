"""anchor-point: the anchor point of a cable differs from the profile."""

from dataclasses import replace

import numpy as np

from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, LinePlace, Stage


def apply(place: LinePlace, at: At, values: Values) -> LinePlace:
    """A line whose anchor point is shifted."""
    shift = np.array([values["x"], values["y"], values["z"]])
    return replace(place, anchor_point=place.anchor_point + shift)


EFFECT = Effect(
    id="anchor-point",
    stage=Stage.LINE_PLACE,
    parameters=tuple(
        Parameter(axis, "m", null=0.0, typical=3e-3, low=-0.2, high=0.2) for axis in "xyz"
    ),
    apply=apply,
    outputs=("cable_length",),
    part="platform",
    variable="pose",
    what="The anchor point of the cable on the platform differs from the profile.",
    formula="b + δb, δb in the platform frame",
    source="CABTIVE paper, Tables 3 and 6 (up to 10 mm apart, nominal to calibrated)",
    looks_like="One line's length error by the cable direction in the platform frame.",
    confused_with=("exit-point", "home-length"),
    told_apart="Poses that turn the platform: without rotation it is an exit point the other way.",
    needs=("robot",),
    on_robot=frozenset({"one"}),
)
