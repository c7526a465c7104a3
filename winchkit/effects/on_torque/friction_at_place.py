"""friction-at-place: Coulomb friction around one position."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.effects.transition import MOTOR_TRANSITION, motor_direction
from winchkit.model.stages import At, Stage

_PLACES = tuple((k + 0.5) / 12 for k in range(12))


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque plus s c exp(−((φ − φ0)/w)²)."""
    distance = (at.drum_angle - values["place"]) / values["width"]
    return torque + values["torque"] * motor_direction(at, values) * np.exp(-(distance**2))


EFFECT = Effect(
    id="friction-at-place",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("torque", "N m", null=0.0, typical=0.02, low=0.0, high=1e6),
        Parameter(
            "place", "rad", null=0.0, typical=1.0, low=-1e6, high=1e6,
            role="shape", grid=_PLACES, over="drum_angle",
        ),
        Parameter(
            "width", "rad", null=1.0, typical=1.0, low=1e-4, high=1e5,
            role="shape", grid=(1 / 12,), along="drum_angle",
        ),
        MOTOR_TRANSITION,
    ),
    apply=apply,
    outputs=("motor_torque",),
    reduces_to=("motor-coulomb",),
    what="Friction is larger around one position: a damaged tooth or bearing, dirt, a bent shaft.",
    formula="τ + s c exp(−((φ − φ0)/w)²), φ the drum angle since the reference",
    source="Coulomb friction with a smooth window",
    looks_like="A bump of the torque error over the position, with the sign of the direction.",
    confused_with=("motor-coulomb", "pulley-coulomb"),
    told_apart="The full stroke in both directions; a pulley's place is in the tension too.",
)  # fmt: skip
