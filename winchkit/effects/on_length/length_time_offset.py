"""length-time-offset: the length instrument's samples are late."""

import numpy as np
from numpy.typing import NDArray

from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage

Array = NDArray[np.float64]


def apply(length: Array, at: At, values: Values) -> Array:
    """Length as it was a delay ago, by cubic Hermite interpolation; held at the run's ends."""
    time = at.time
    if values["delay"] == 0.0 or len(time) < 2:
        return length
    slope = np.gradient(length, time)
    asked = np.clip(time - values["delay"], time[0], time[-1])
    left = np.clip(np.searchsorted(time, asked, side="right") - 1, 0, len(time) - 2)
    step = time[left + 1] - time[left]
    u = (asked - time[left]) / step
    rise = length[left + 1] - length[left]
    start, end = slope[left] * step - rise, rise - slope[left + 1] * step
    return length[left] + u * rise + u * (1 - u) * ((1 - u) * start + u * end)


EFFECT = Effect(
    id="length-time-offset",
    stage=Stage.LENGTH_INSTRUMENT,
    parameters=(Parameter("delay", "s", null=0.0, typical=0.02, low=-2.0, high=2.0),),
    apply=apply,
    outputs=("cable_length",),
    what="The length instrument filters or is stamped late against the drive.",
    formula="ℓ(t − δt)",
    source="definition of a delay",
    looks_like="A length error in proportion to the speed, so of both signs.",
    confused_with=("gear-backlash",),
    told_apart="A ladder of speeds in both directions: backlash stays the same.",
)
