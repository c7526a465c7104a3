"""friction-of-torque: friction in proportion to the torque of the motor."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.effects.transition import MOTOR_TRANSITION, motor_direction
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque τ/(1 − s μ sgn τ), which is τ plus s μ of the magnitude of the result."""
    return torque / (1.0 - values["share"] * motor_direction(at, values) * np.sign(torque))


EFFECT = Effect(
    id="friction-of-torque",
    stage=Stage.MOTOR,
    parameters=(
        Parameter(
            "share", "1", null=0.0, typical=0.1, low=0.0, high=0.95,
            plausible=Plausible(0.0, 0.9, "a worm gear loses two thirds"),
        ),
        MOTOR_TRANSITION,
    ),
    apply=apply,
    outputs=("motor_torque",),
    what="Friction of teeth and bearings in proportion to the torque of the motor.",
    formula="τ/(1 − s μ sgn τ): τ_m = τ + s μ |τ_m|, τ the torque of the load",
    source="directional load-dependent friction of servos (Duclusaud et al. 2024)",
    looks_like="A step of the torque error with the direction, larger where the motor drives the "
    "load than where the load drives the motor.",
    confused_with=("friction-of-load", "motor-coulomb"),
    told_apart="Two loads in both directions, one of them near zero.",
    needs=("ungeared",),
    family="load friction",
    order=-1,
)  # fmt: skip
