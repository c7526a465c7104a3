"""motor-stribeck: higher friction of the motor side at low speed."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.effects.transition import MOTOR_TRANSITION, motor_direction
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque plus s b exp(−(θ'/ω_s)²)."""
    return torque + values["torque"] * motor_direction(at, values) * np.exp(
        -((at.motor_rate / values["stribeck_speed"]) ** 2)
    )


EFFECT = Effect(
    id="motor-stribeck",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("torque", "N m", null=0.0, typical=0.02, low=0.0, high=1e6),
        Parameter(
            "stribeck_speed",
            "rad/s",
            null=5.0,
            typical=5.0,
            low=0.05,
            high=1e3,
            role="shape",
            grid=(1.0, 4.0, 15.0, 50.0),
        ),
        MOTOR_TRANSITION,
    ),
    apply=apply,
    outputs=("motor_torque",),
    variable="speed",
    reduces_to=("motor-coulomb",),
    what="Friction of bearings and seals is higher at low speed, before a film builds up.",
    formula="τ + s b exp(−(θ'/ω_s)²)",
    source="Stribeck curve (Armstrong-Hélouvry et al. 1994)",
    looks_like="Additional torque against the motion at low speed only.",
    confused_with=("motor-coulomb", "pulley-stribeck"),
    told_apart="Very slow ramps at several speeds.",
    family="motor friction",
)
