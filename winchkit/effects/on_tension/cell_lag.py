"""cell-lag: low-pass filter of the load cell's amplifier."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.recurrence import first_order_lag
from winchkit.model.stages import At, Stage


def apply(tension: Array, at: At, values: Values) -> Array:
    """Reading after a first-order filter that starts at the first value."""
    return first_order_lag(tension, at.time, values["time_constant"])


EFFECT = Effect(
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
    apply=apply,
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
