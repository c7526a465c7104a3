"""cell-offset: the load cell's zero is off."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage


def apply(tension: Array, at: At, values: Values) -> Array:
    """Reading T + o."""
    return tension + values["offset"]


EFFECT = Effect(
    id="cell-offset",
    stage=Stage.CELL,
    parameters=(Parameter("offset", "N", null=0.0, typical=5.0, low=-1e6, high=1e6),),
    apply=apply,
    outputs=("tension",),
    what="The cell was not tared, or its zero has moved.",
    formula="T + o",
    source="load-cell practice",
    looks_like="A constant tension error, at any load.",
    confused_with=("cable-weight", "cell-drift", "cell-thermal"),
    told_apart="Two loads and the full stroke; a tare without load.",
    family="cell static",
    needs=("load",),
    order=1,
    on_robot=frozenset({"one"}),
)
