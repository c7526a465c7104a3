"""frame-compliance: elastic deflection of the frame under the cable force."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.stages import At, Stage


def apply(length: Array, at: At, values: Values) -> Array:
    """Length plus T/k."""
    return length + at.tension / values["stiffness"]


EFFECT = Effect(
    id="frame-compliance",
    stage=Stage.FRAME,
    parameters=(
        Parameter(
            "stiffness",
            "N/m",
            null=np.inf,
            typical=2e5,
            low=100.0,
            high=np.inf,
            reciprocal=True,
            plausible=Plausible(
                1000.0, float("inf"), "a frame that gives by 1 mm under 1 N is not fixed"
            ),
        ),
    ),
    apply=apply,
    outputs=("cable_length",),
    variable="load",
    what="Mast, pulley brackets and exit point deflect towards the load.",
    formula="ℓ + T/k",
    source="Hooke",
    looks_like="A length error in proportion to the tension, the same at every length.",
    confused_with=("cable-elongation-linear",),
    told_apart="The same load at several lengths; several loads over the full stroke.",
    needs=("cable_force",),
    on_robot=frozenset({"one", "all"}),
)
