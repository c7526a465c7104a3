"""cell-drift: the load cell's zero drifts with time."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage


def apply(tension: Array, at: At, values: Values) -> Array:
    """Reading T + d t, t from the run's start."""
    return tension + values["drift"] * at.time


EFFECT = Effect(
    id="cell-drift",
    stage=Stage.CELL,
    parameters=(Parameter("drift", "N/s", null=0.0, typical=0.02, low=-100.0, high=100.0),),
    apply=apply,
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
