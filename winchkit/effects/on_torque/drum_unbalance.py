"""drum-unbalance: eccentric mass of the drum, one period per turn."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque plus a sin(φ + p), φ the drum angle."""
    return torque + values["amplitude"] * np.sin(at.drum_angle + values["phase"])


EFFECT = Effect(
    id="drum-unbalance",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("amplitude", "N m", null=0.0, typical=0.01, low=0.0, high=1e6),
        Parameter("phase", "rad", null=0.0, typical=1.0),
    ),
    apply=apply,
    outputs=("motor_torque",),
    part="drum",
    variable="drum_angle",
    what="The centre of mass of the drum is not on its axis.",
    formula="τ + a sin(φ + p), a = m g e / ratio, φ the drum angle",
    source="statics of an eccentric mass on a horizontal axis",
    looks_like="A sine once per drum turn in the torque, the same at every load.",
    confused_with=("drum-eccentricity", "motor-cogging", "joint-gravity"),
    told_apart="Two loads: the torque by an eccentric drum grows with the load, and its length has "
    "the same period.",
    needs=("whole_turns",),
    polar=("amplitude", "phase"),
    order=-2,
)
