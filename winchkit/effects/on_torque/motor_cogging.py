"""motor-cogging: cogging torque of the motor, a whole order of the motor turn."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import MOTOR_ORDERS, Effect, Parameter, Values, order_per_turn
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque plus a sin(kθ + p)."""
    return torque + values["amplitude"] * np.sin(values["order"] * at.motor_angle + values["phase"])


EFFECT = Effect(
    id="motor-cogging",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("amplitude", "N m", null=0.0, typical=0.01, low=0.0, high=1e6),
        Parameter("phase", "rad", null=0.0, typical=1.0),
        order_per_turn(MOTOR_ORDERS, typical=2.0),
    ),
    apply=apply,
    outputs=("motor_torque",),
    variable="motor_angle",
    what="Slots and poles cause a torque that depends only on the motor angle.",
    formula="τ + a sin(k θ + p), k from poles, slots and their multiples",
    source="cogging torque of permanent-magnet motors",
    looks_like="A ripple of the torque over the motor angle, the same at every load.",
    confused_with=("gear-transmission-error",),
    told_apart="A scan of the orders under two loads: a gear's ripple grows with the load.",
    polar=("amplitude", "phase"),
    repeatable=True,
)
