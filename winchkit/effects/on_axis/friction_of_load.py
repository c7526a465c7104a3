"""friction-of-load: friction in proportion to the torque of the load.

The load is weight, springs and a cable. The inertia is none: no recording of the motor shows which
part of it the gear transmits, and which is the rotor's.
"""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.effects.transition import MOTOR_TRANSITION, motor_direction
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque plus s μ |τ|."""
    return torque + values["share"] * motor_direction(at, values) * np.abs(torque)


EFFECT = Effect(
    id="friction-of-load",
    stage=Stage.MOTOR,
    parameters=(
        Parameter(
            "share", "1", null=0.0, typical=0.1, low=0.0, high=5.0,
            plausible=Plausible(0.0, 0.9, "a worm gear loses two thirds"),
        ),
        MOTOR_TRANSITION,
    ),
    apply=apply,
    outputs=("motor_torque",),
    what="Friction of teeth and bearings in proportion to the torque of the load.",
    formula="τ + s μ |τ|, τ the torque of the load",
    source="load-dependent friction of robot joints (Bittencourt, Gunnarsson 2012) and of servos "
    "(Duclusaud et al. 2024)",
    looks_like="A step of the torque error with the direction, in proportion to the load.",
    confused_with=("friction-of-torque", "motor-coulomb", "stribeck-of-load"),
    told_apart="Two loads in both directions, one of them near zero.",
    needs=("ungeared",),
    family="load friction",
    order=-1,
)  # fmt: skip
