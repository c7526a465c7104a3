"""cell-creep: the reading keeps changing after a step of the load."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.recurrence import first_order_lag, share
from winchkit.model.stages import At, Stage


def apply(tension: Array, at: At, values: Values) -> Array:
    """Reading plus a creeping share of it; creep starts at zero."""
    begun = values["start"] * tension[0]
    crept = first_order_lag(tension, at.time, values["time_constant"], begun)
    return tension + values["fraction"] * crept


def carried(after: Array, before: Array, _at: At, values: Values) -> Array:
    """c/T at the last sample; unchanged without a tension or a creep."""
    settled = values["fraction"] * before[-1]
    return share(after[-1] - before[-1], settled, values["start"])


EFFECT = Effect(
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
    apply=apply,
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
    carry=carried,
    rested=1.0,
)
