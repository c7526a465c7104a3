"""cell-clipping: the reading of the load cell saturates."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.stages import At, Stage

_LIMITS = 0.3, 0.5, 0.7, 0.85, 0.95


def apply(tension: Array, at: At, values: Values) -> Array:
    """Reading T − q max(T − limit, 0)."""
    return tension - values["share"] * np.maximum(tension - values["limit"], 0.0)


EFFECT = Effect(
    id="cell-clipping",
    stage=Stage.CELL,
    parameters=(
        Parameter(
            "share", "1", null=0.0, typical=0.5, low=0.0, high=1.0,
            plausible=Plausible(0.0, 1.0, "one is a full stop"),
        ),
        Parameter(
            "limit", "N", null=300.0, typical=300.0, low=1e-3, high=1e7,
            role="shape", grid=_LIMITS, over="tension",
        ),
    ),
    apply=apply,
    outputs=("tension",),
    variable="load",
    what="The amplifier or the converter saturates; or a stop takes over a part of the force.",
    formula="T − q max(T − limit, 0); q = 1 is a hard limit",
    source="saturation of amplifiers; overload stops of load cells",
    looks_like="A reading that stays at one value, or rises less, above a tension.",
    confused_with=("cell-nonlinearity", "cell-gain"),
    told_apart="Weights above and below the limit; the full scale on the amplifier's data sheet.",
    needs=("load",),
    order=8,
    left_out="beyond its limit the reading does not determine the tension; use a larger cell",
)  # fmt: skip
