"""stribeck-of-load: friction in proportion to the torque of the load, higher at low speed."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.effects.transition import MOTOR_TRANSITION, motor_direction
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque plus s μ |τ| exp(−(θ'/ω_s)²)."""
    fallen = np.exp(-((at.motor_rate / values["stribeck_speed"]) ** 2))
    return torque + values["share"] * motor_direction(at, values) * fallen * np.abs(torque)


EFFECT = Effect(
    id="stribeck-of-load",
    stage=Stage.MOTOR,
    parameters=(
        Parameter(
            "share", "1", null=0.0, typical=0.1, low=0.0, high=5.0,
            plausible=Plausible(0.0, 0.9, "a worm gear loses two thirds"),
        ),
        Parameter(
            "stribeck_speed", "rad/s", null=5.0, typical=5.0, low=0.05, high=1e3,
            role="shape", grid=(0.3, 3.0, 30.0),
        ),
        MOTOR_TRANSITION,
    ),
    apply=apply,
    outputs=("motor_torque",),
    reduces_to=("friction-of-load",),
    what="Friction of teeth in proportion to the torque of the load is higher at low speed.",
    formula="τ + s μ |τ| exp(−(θ'/ω_s)²), τ the torque of the load",
    source="load-dependent Stribeck friction of robot joints (Bittencourt, Gunnarsson 2012)",
    looks_like="Additional torque against the motion at low speed, in proportion to the load.",
    confused_with=("friction-of-load", "motor-stribeck"),
    told_apart="Slow ramps at several speeds with two loads.",
    needs=("ungeared",),
    family="load friction",
    order=-1,
)  # fmt: skip
