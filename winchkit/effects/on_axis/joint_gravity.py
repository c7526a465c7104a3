"""joint-gravity: weight of a part that an axis turns."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque plus a sin(φ + p), φ the angle of the joint."""
    return torque + values["amplitude"] * np.sin(at.drum_angle + values["phase"])


EFFECT = Effect(
    id="joint-gravity",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("amplitude", "N m", null=0.0, typical=1.0, low=0.0, high=1e6),
        Parameter("phase", "rad", null=0.0, typical=1.0),
    ),
    apply=apply,
    outputs=("motor_torque",),
    part="load",
    variable="drum_angle",
    what="The axis carries a part whose centre of mass is not on it.",
    formula="τ + a sin(φ + p), a = m g l / ratio, φ the angle of the joint",
    source="statics of a pendulum; minimal parameters m l of robot dynamics (Khalil, Dombre 2002)",
    looks_like="A sine of the joint angle in the torque, the same in both directions.",
    confused_with=("drum-unbalance", "spring-balancer", "motor-coulomb-asymmetry"),
    told_apart="A stroke of at least a quarter turn: a short one is a straight line.",
    needs=("axis",),
    polar=("amplitude", "phase"),
    order=-2,
)
