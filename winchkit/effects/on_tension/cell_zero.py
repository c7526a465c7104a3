"""Effects on the zero of the load cell: offset, drift, temperature, crosstalk from the torque."""

from __future__ import annotations

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage


def _cell_offset(tension: Array, at: At, values: Values) -> Array:
    return tension + values["offset"]


def _cell_offset_corrected(reading: Array, at: At, values: Values) -> Array:
    return reading - values["offset"]


CELL_OFFSET = Effect(
    id="cell-offset",
    stage=Stage.CELL,
    parameters=(Parameter("offset", "N", null=0.0, typical=5.0, low=-1e6, high=1e6),),
    apply=_cell_offset,
    correct=_cell_offset_corrected,
    outputs=("tension",),
    what="The cell was not tared, or its zero has moved.",
    formula="T + o",
    source="load-cell practice",
    looks_like="A constant tension error, at any load.",
    confused_with=("cable-weight", "cell-drift", "cell-thermal", "motor-coulomb-asymmetry"),
    told_apart="Two known loads and the full stroke; a tare without load.",
    family="cell static",
    needs=("cell",),
    order=1,
    on_robot=frozenset({"one"}),
)


def _cell_drift(tension: Array, at: At, values: Values) -> Array:
    return tension + values["drift"] * at.time


CELL_DRIFT = Effect(
    id="cell-drift",
    stage=Stage.CELL,
    parameters=(Parameter("drift", "N/s", null=0.0, typical=0.02, low=-100.0, high=100.0),),
    apply=_cell_drift,
    outputs=("tension",),
    variable="time",
    what="The zero of the amplifier or the cell drifts linearly in time.",
    formula="T + d t, t from the run's start",
    source="load-cell practice",
    looks_like="A tension error that grows with the time, at any load.",
    confused_with=("cell-thermal", "cell-creep", "cell-offset"),
    told_apart="Temperature up and down; a repeat, in which the time starts again.",
    needs=("load",),
    order=5,
    left_out="it counts time from a run's start; tare or zero the cell",
)

_AT_CALIBRATION = 20.0
"""Degrees Celsius: usual temperature of a calibration; another shifts the zero, which is fitted
beside it."""


def _cell_thermal(tension: Array, at: At, values: Values) -> Array:
    return tension + values["sensitivity"] * (at.temperature - _AT_CALIBRATION)


CELL_THERMAL = Effect(
    id="cell-thermal",
    stage=Stage.CELL,
    parameters=(Parameter("sensitivity", "N/K", null=0.0, typical=0.5, low=-1e3, high=1e3),),
    apply=_cell_thermal,
    outputs=("tension",),
    variable="temperature",
    what="The zero of the cell follows its temperature.",
    formula="T + k (temperature − 20 °C)",
    source="temperature effect on zero, as data sheets give it",
    looks_like="A tension error that depends on the temperature, at any load.",
    confused_with=("cell-drift", "cell-offset"),
    told_apart="Temperature up and down.",
    needs=("load", "temperature"),
    order=6,
    on_robot=frozenset({"one"}),
)


def _cell_crosstalk(tension: Array, at: At, values: Values) -> Array:
    return tension + values["share"] * at.motor_torque


CELL_CROSSTALK = Effect(
    id="cell-crosstalk",
    stage=Stage.CELL,
    parameters=(Parameter("share", "N/(N m)", null=0.0, typical=5.0, low=-1e5, high=1e5),),
    apply=_cell_crosstalk,
    outputs=("tension",),
    variable="motor_torque",
    what="The motor current couples into the cell's cable, or the reaction torque into its mount.",
    formula="T + c m, m the measured motor torque",
    source="electromagnetic interference and side load of load cells, first order",
    looks_like="A tension error in proportion to the motor torque, its friction included.",
    confused_with=("cell-gain", "pulley-coulomb", "pulley-inertia"),
    told_apart="The same motion with the drive disabled, moved by hand, or two directions.",
    needs=("load", "torque"),
    order=4,
    left_out="it needs the measured torque; shield the cell's cable",
)
