"""gear-transmission-error: periodic error of the gear, a whole order of the motor turn."""

import numpy as np

from winchkit.effects.effect import MOTOR_ORDERS, Effect, Parameter, Values, order_per_turn
from winchkit.model.stages import At, Path, Stage


def apply(path: Path, at: At, values: Values) -> Path:
    """Drum angle plus a sin(kθ + p), and its derivative by the motor angle."""
    size, order = values["amplitude"], values["order"]
    turned = order * at.motor_angle + values["phase"]
    return Path(path.value + size * np.sin(turned), path.slope + size * order * np.cos(turned))


EFFECT = Effect(
    id="gear-transmission-error",
    stage=Stage.DRUM_ANGLE,
    parameters=(
        Parameter("amplitude", "rad", null=0.0, typical=2e-4, low=0.0, high=0.05),
        Parameter("phase", "rad", null=0.0, typical=1.0),
        order_per_turn(MOTOR_ORDERS, typical=2.0),
    ),
    apply=apply,
    outputs=("cable_length", "motor_torque"),
    variable="motor_angle",
    what="Runout of teeth and shafts: the drum leads and lags within each motor turn.",
    formula="φ + a sin(k θ + p), k whole per motor turn",
    source="static transmission error of gears, one harmonic",
    looks_like="A ripple over the motor angle: in length, and in torque in proportion to the load.",
    confused_with=("motor-cogging", "drum-eccentricity"),
    told_apart="A scan of the orders under two loads: cogging does not grow with the load.",
    needs=("gearing",),
    order=1,
    polar=("amplitude", "phase"),
    repeatable=True,
)
