"""cell-thermal: the load cell's zero moves with temperature."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage

_AT_CALIBRATION = 20.0
"""Degrees Celsius: usual temperature of a calibration; another shifts the zero, which is fitted
beside it."""


def apply(tension: Array, at: At, values: Values) -> Array:
    """Reading T + k (temperature − 20 °C)."""
    return tension + values["sensitivity"] * (at.temperature - _AT_CALIBRATION)


EFFECT = Effect(
    id="cell-thermal",
    stage=Stage.CELL,
    parameters=(Parameter("sensitivity", "N/K", null=0.0, typical=0.5, low=-1e3, high=1e3),),
    apply=apply,
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
