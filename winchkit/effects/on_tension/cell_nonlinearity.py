"""cell-nonlinearity: curvature of the load cell's characteristic."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage

_UNIT_TENSION = 500.0
"""N: middle of a bench's tensions, so that the parameter is the error there; another would scale
the parameter and its declared sizes."""


def apply(tension: Array, at: At, values: Values) -> Array:
    """Reading T + q (T/500 N)²."""
    return tension + values["quadratic"] * (tension / _UNIT_TENSION) ** 2


EFFECT = Effect(
    id="cell-nonlinearity",
    stage=Stage.CELL,
    parameters=(Parameter("quadratic", "N", null=0.0, typical=5.0, low=-1e4, high=1e4),),
    apply=apply,
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
