"""load-lever: the load acts through a lever that turns with the drum."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage


def apply(tension: Array, at: At, values: Values) -> Array:
    """Tension T (1 + a sin(φ + p))."""
    return tension * (1.0 + values["amplitude"] * np.sin(at.drum_angle + values["phase"]))


EFFECT = Effect(
    id="load-lever",
    stage=Stage.CABLE_WEIGHT,
    parameters=(
        Parameter("amplitude", "1", null=0.0, typical=0.02, low=0.0, high=10.0),
        Parameter("phase", "rad", null=0.0, typical=1.0),
    ),
    apply=apply,
    outputs=("tension", "motor_torque"),
    part="load",
    variable="drum_angle",
    what="The load acts through a lever, whose effective arm changes with its angle.",
    formula="(1 + a sin(φ + p)) T, φ the drum angle",
    source="statics: the arm of a force on a lever is its length times the cosine of its angle",
    looks_like="A sine of the drum angle in tension and torque, in proportion to the load.",
    confused_with=("drum-eccentricity", "drum-unbalance", "cell-gain"),
    told_apart="Two loads; the tension, which an eccentric or unbalanced drum leaves unchanged.",
    needs=("load",),
    order=1,
    polar=("amplitude", "phase"),
)
