"""Effects on the characteristic of the load cell: gain, curvature, saturation."""

from __future__ import annotations

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values, with_gain
from winchkit.model.stages import At, Stage


def _cell_gain_corrected(reading: Array, at: At, values: Values) -> Array:
    return reading / (1.0 + values["gain_error"])


CELL_GAIN = Effect(
    id="cell-gain",
    stage=Stage.CELL,
    parameters=(
        Parameter(
            "gain_error",
            "1",
            null=0.0,
            typical=0.01,
            low=-0.9,
            high=10.0,
            plausible=Plausible(
                -0.5,
                1.0,
                "a span is per cent off; a factor of two is a second cable or another unit",
            ),
        ),
    ),
    apply=with_gain,
    correct=_cell_gain_corrected,
    outputs=("tension",),
    variable="load",
    what="The cell's span is wrong: calibration, mounting angle, a parallel load path.",
    formula="(1 + g) T",
    source="load-cell practice",
    looks_like="A tension error in proportion to the tension, equal in both directions.",
    confused_with=(
        "pulley-coulomb",
        "pulley-capstan",
        "cell-nonlinearity",
        "torque-constant",
        "load-gain",
    ),
    told_apart="Several known loads in both directions; the torque distinguishes it from a wrong "
    "load.",
    family="cell static",
    needs=("cell",),
    order=0,
    on_robot=frozenset({"one"}),
)

_UNIT_TENSION = 500.0
"""N: middle of a bench's tensions, so that the parameter is the error there; another would scale
the parameter and its declared sizes."""


def _cell_nonlinearity(tension: Array, at: At, values: Values) -> Array:
    return tension + values["quadratic"] * (tension / _UNIT_TENSION) ** 2


CELL_NONLINEARITY = Effect(
    id="cell-nonlinearity",
    stage=Stage.CELL,
    parameters=(Parameter("quadratic", "N", null=0.0, typical=5.0, low=-1e4, high=1e4),),
    apply=_cell_nonlinearity,
    outputs=("tension",),
    variable="load",
    what="The cell's sensitivity changes with the load: overload, side force, a wrong mounting.",
    formula="T + q (T/500 N)²",
    source="second-order characteristic of a load cell",
    looks_like="A tension error that is curved over the tension.",
    confused_with=("cell-gain", "cable-elongation-quartic"),
    told_apart="At least three loads over the cell's range.",
    family="cell static",
    needs=("load",),
    order=2,
    on_robot=frozenset({"one"}),
)

_LIMITS = 0.3, 0.5, 0.7, 0.85, 0.95


def _cell_clipping(tension: Array, at: At, values: Values) -> Array:
    return tension - values["share"] * np.maximum(tension - values["limit"], 0.0)


CELL_CLIPPING = Effect(
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
    apply=_cell_clipping,
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
