"""Effects of earlier tensions on the reading of the load cell: hysteresis, creep, filter."""

from __future__ import annotations

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.derivatives import with_turning_points
from winchkit.model.friction import dahl
from winchkit.model.recurrence import first_order_lag, share
from winchkit.model.stages import At, Stage

_REACH = 0.1
"""Share of the tension over which the loop builds up after a reversal (rule of thumb: it is closed
well within the ranges of 20 % and more that a cell is loaded over; tenfold it would not close)."""


def _cell_hysteresis(tension: Array, at: At, values: Values) -> Array:
    """Reading less a Dahl loop of fraction·T that builds up over a tenth of the tension."""
    fraction = values["fraction"]
    if fraction == 0.0:
        return tension
    turned, own = with_turning_points(tension)
    limit = fraction * np.abs(turned)
    return tension - dahl(turned, limit, fraction / _REACH, start=values["start"])[own]


def _cell_hysteresis_carried(after: Array, before: Array, _at: At, values: Values) -> Array:
    """F/F_c at the last sample."""
    limit = values["fraction"] * np.abs(before[-1])
    return share(before[-1] - after[-1], limit)


CELL_HYSTERESIS = Effect(
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
    apply=_cell_hysteresis,
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
    carry=_cell_hysteresis_carried,
)


def _cell_creep(tension: Array, at: At, values: Values) -> Array:
    """Reading plus a creeping share of it; creep starts at zero."""
    begun = values["start"] * tension[0]
    crept = first_order_lag(tension, at.time, values["time_constant"], begun)
    return tension + values["fraction"] * crept


def _cell_creep_carried(after: Array, before: Array, _at: At, values: Values) -> Array:
    """c/T at the last sample; unchanged without a tension or a creep."""
    settled = values["fraction"] * before[-1]
    return share(after[-1] - before[-1], settled, values["start"])


CELL_CREEP = Effect(
    id="cell-creep",
    stage=Stage.CELL,
    parameters=(
        Parameter(
            "fraction",
            "1",
            null=0.0,
            typical=1e-3,
            low=-0.1,
            high=0.1,
            plausible=Plausible(-0.05, 0.05, "OIML R60: 0.03 %, a plastic mount some per cent"),
        ),
        Parameter(
            "time_constant",
            "s",
            null=600.0,
            typical=600.0,
            low=1.0,
            high=1e5,
            role="shape",
            grid=(30.0, 120.0, 600.0, 1800.0),
        ),
        Parameter("start", "1", null=0.0, typical=0.5, low=-1.0, high=2.0, role="fixed"),
    ),
    apply=_cell_creep,
    outputs=("tension",),
    reduces_to=("cell-gain",),
    what="The spring element of the cell settles under load and recovers without.",
    formula="T + f c, c' = (T − c)/τ; start: c/T at the run's start",
    source="creep of load cells, OIML R60: about 0.03 % in 30 min",
    looks_like="The reading drifts after a load step, and again after unloading.",
    confused_with=("cell-drift", "cable-creep"),
    told_apart="Hold after a load step, then unload; cable-creep moves the length instead.",
    needs=("load",),
    order=4,
    memory=True,
    carry=_cell_creep_carried,
    rested=1.0,
)


def _cell_lag(tension: Array, at: At, values: Values) -> Array:
    """Reading after a first-order filter that starts at the first value."""
    return first_order_lag(tension, at.time, values["time_constant"])


CELL_LAG = Effect(
    id="cell-lag",
    stage=Stage.CELL,
    parameters=(
        Parameter(
            "time_constant",
            "s",
            null=0.0,
            typical=0.05,
            low=0.0,
            high=10.0,
            plausible=Plausible(0.0, 2.0, "filters of amplifiers settle within seconds"),
        ),
    ),
    apply=_cell_lag,
    outputs=("tension",),
    what="The cell's amplifier low-passes its reading, which delays and smooths it.",
    formula="τ T_m' + T_m = T",
    source="first-order filter, exact for a signal linear between samples",
    looks_like="A tension error in proportion to the rate of the tension.",
    confused_with=("pulley-inertia", "pulley-dahl"),
    told_apart="Fast moves under two loads, and a step of the load.",
    needs=("load",),
    order=7,
    left_out="inverting a filter would amplify the noise; at rest it vanishes",
)
