"""motor-viscous-asymmetry: friction grows faster with speed one way than the other."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque with d |θ'| on it."""
    return torque + values["viscosity_difference"] * np.abs(at.motor_rate)


EFFECT = Effect(
    id="motor-viscous-asymmetry",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("viscosity_difference", "N m s", null=0.0, typical=3e-4, low=-1e6, high=1e6),
    ),
    apply=apply,
    outputs=("motor_torque",),
    what="Preloaded screws, worms and lip seals drag more one way than the other, in proportion "
    "to the speed.",
    formula="τ + d |θ'|, d = (b₊ − b₋)/2",
    source="viscous friction, one value a direction; seen on EMPS (Janot et al. 2019), whose two "
    "directions differ",
    looks_like="A torque error that is even in the motor's speed and linear in it.",
    confused_with=("motor-coulomb-asymmetry", "motor-viscous"),
    told_apart="A ladder of speeds in both directions: an offset is the same at every speed.",
    family="motor friction",
)
