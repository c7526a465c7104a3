"""cell-hysteresis: lower readings of the load cell while loading than while unloading."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.derivatives import with_turning_points
from winchkit.model.friction import dahl
from winchkit.model.recurrence import share
from winchkit.model.stages import At, Stage

_REACH = 0.1
"""Share of the tension over which the loop builds up after a reversal (rule of thumb: it is closed
well within the ranges of 20 % and more that a cell is loaded over; tenfold it would not close)."""


def apply(tension: Array, at: At, values: Values) -> Array:
    """Reading less a Dahl loop of fraction·T that builds up over a tenth of the tension."""
    fraction = values["fraction"]
    if fraction == 0.0:
        return tension
    turned, own = with_turning_points(tension)
    limit = fraction * np.abs(turned)
    return tension - dahl(turned, limit, fraction / _REACH, start=values["start"])[own]


def carried(after: Array, before: Array, _at: At, values: Values) -> Array:
    """F/F_c at the last sample."""
    limit = values["fraction"] * np.abs(before[-1])
    return share(before[-1] - after[-1], limit)


EFFECT = Effect(
    id="cell-hysteresis",
    stage=Stage.CELL,
    parameters=(
        Parameter(
            "fraction",
            "1",
            null=0.0,
            typical=2e-3,
            low=0.0,
            high=0.2,
            plausible=Plausible(0.0, 0.1, "data sheets: 0.05 %, a sticking mount up to a tenth"),
        ),
        Parameter("start", "1", null=0.0, typical=0.5, low=-1.0, high=1.0, role="fixed"),
    ),
    apply=apply,
    outputs=("tension",),
    what="Micro-slip in the cell and its mounting: readings at loading and unloading differ.",
    formula="T − F, dF/dT = 10 f (1 − s F/F_c), F_c = f T; start: F/F_c at the run's start",
    source="Dahl loop over the tension; combined error of data sheets",
    looks_like="A hysteresis loop of the tension error over the tension, at any motion.",
    confused_with=("pulley-dahl", "pulley-coulomb"),
    told_apart="Static weights up and down, without motion.",
    needs=("load",),
    order=3,
    memory=True,
    carry=carried,
)
