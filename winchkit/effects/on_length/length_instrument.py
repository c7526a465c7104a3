"""Effects of the length instrument: delay, gain."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values, with_gain
from winchkit.model.derivatives import shifted
from winchkit.model.stages import At, Stage


def _length_time_offset(length: Array, at: At, values: Values) -> Array:
    """Length one delay earlier."""
    return shifted(length, at.time, -values["delay"])


LENGTH_TIME_OFFSET = Effect(
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
    apply=_length_time_offset,
    outputs=("cable_length",),
    variable="speed",
    what="The length instrument filters, or its time stamps are later than the drive's.",
    formula="ℓ(t − δt)",
    source="definition of a delay",
    looks_like="A length error in proportion to the speed, of both signs.",
    confused_with=("gear-backlash",),
    told_apart="A ladder of speeds in both directions: backlash stays the same.",
)


LENGTH_GAIN = Effect(
    id="length-gain",
    stage=Stage.LENGTH_INSTRUMENT,
    parameters=(
        Parameter(
            "gain_error",
            "1",
            null=0.0,
            typical=5e-3,
            low=-0.9,
            high=10.0,
            plausible=Plausible(
                -0.2, 0.25, "a worn measuring wheel is per cent off; more is another scale, or unit"
            ),
        ),
    ),
    apply=with_gain,
    outputs=("cable_length",),
    variable="cable_length",
    what="The length instrument has a gain error: measuring wheel, counts per metre, scale.",
    formula="(1 + g) ℓ, beside the offset of the instrument",
    source="sensitivity of a measuring system (JCGM 200:2012, 4.12)",
    looks_like="A length error in proportion to the length; none in torque and tension.",
    confused_with=(
        "drum-radius",
        "gear-ratio",
        "layer-thickness",
        "guide-offset",
        "cable-elongation-linear",
    ),
    told_apart="The torque under a known load, which a wrong radius or ratio changes too; a tape "
    "measure.",
    needs=("cable",),
    order=-1,
)
