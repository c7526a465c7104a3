"""torque-ripple: ripple of the torque constant, whole orders of the motor turn."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import MOTOR_ORDERS, Effect, Parameter, Values, order_per_turn
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque (1 + a sin(kθ + p)) τ."""
    wave = np.sin(values["order"] * at.motor_angle + values["phase"])
    return torque * (1.0 + values["amplitude"] * wave)


EFFECT = Effect(
    id="torque-ripple",
    stage=Stage.TORQUE_SIGNAL,
    parameters=(
        # Above 1 the torque constant would change its sign within a turn.
        Parameter("amplitude", "1", null=0.0, typical=0.02, low=0.0, high=1.0),
        Parameter("phase", "rad", null=0.0, typical=1.0),
        order_per_turn(MOTOR_ORDERS, typical=2.0),
    ),
    apply=apply,
    outputs=("motor_torque",),
    variable="motor_angle",
    what="The torque constant depends on the rotor's position, by its poles and the inverter.",
    formula="(1 + a sin(k θ + p)) τ, k from pole pairs and slots",
    source="mutual torque ripple of permanent-magnet motors (Jahns, Soong 1996)",
    looks_like="A ripple of the torque over the motor angle, in proportion to the torque; none in "
    "length.",
    confused_with=("gear-transmission-error", "motor-cogging"),
    told_apart="Two loads: cogging does not grow with the load. The length: a transmission error "
    "is in it too.",
    order=-1,
    polar=("amplitude", "phase"),
    repeatable=True,
)
