"""length-time-offset: delay of the length instrument."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.derivatives import shifted
from winchkit.model.stages import At, Stage


def apply(length: Array, at: At, values: Values) -> Array:
    """Length one delay earlier."""
    return shifted(length, at.time, -values["delay"])


EFFECT = Effect(
    id="length-time-offset",
    stage=Stage.LENGTH_INSTRUMENT,
    parameters=(
        Parameter(
            "delay",
            "s",
            null=0.0,
            typical=0.02,
            low=-2.0,
            high=2.0,
            plausible=Plausible(-1.0, 1.0, "buses and filters delay by less than a second"),
        ),
    ),
    apply=apply,
    outputs=("cable_length",),
    variable="speed",
    what="The length instrument filters, or its time stamps are later than the drive's.",
    formula="ℓ(t − δt)",
    source="definition of a delay",
    looks_like="A length error in proportion to the speed, of both signs.",
    confused_with=("gear-backlash",),
    told_apart="A ladder of speeds in both directions: backlash stays the same.",
)
