"""motor-viscous-asymmetry: viscous friction depends on the direction."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque plus d |θ'|."""
    return torque + values["viscosity_difference"] * np.abs(at.motor_rate)


EFFECT = Effect(
    id="motor-viscous-asymmetry",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("viscosity_difference", "N m s", null=0.0, typical=3e-4, low=-1e6, high=1e6),
    ),
    apply=apply,
    outputs=("motor_torque",),
    variable="speed",
    what="Viscous friction of preloaded screws, worms and lip seals depends on the direction.",
    formula="τ + d |θ'|, d = (b₊ − b₋)/2",
    source="viscous friction, one value per direction; observed on EMPS (Janot et al. 2019)",
    looks_like="A torque error that is even in the motor's speed and linear in it.",
    confused_with=("motor-coulomb-asymmetry", "motor-viscous"),
    told_apart="A ladder of speeds in both directions: an offset is the same at every speed.",
    family="motor friction",
)
