"""cable-sag: the cable sags under its weight, so that its chord is shorter than the cable."""

from math import cos

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.stages import At, Stage
from winchkit.units import GRAVITY


def apply(length: Array, at: At, values: Values) -> Array:
    """Length less w² ℓ³ cos²(inclination) / 24 T².

    The parabola is valid while the tension exceeds the cable's weight across the chord; below, that
    weight replaces the tension. Without any tension the sag is unknown and set to zero.
    """
    weight = values["mass_per_length"] * GRAVITY * np.abs(at.free_length)
    across = weight * abs(cos(at.profile.path.inclination))
    tension = np.maximum(at.tension, across)
    ratio: Array = np.divide(across, tension, out=np.zeros_like(across), where=at.tension > 0)
    return length - at.free_length * ratio**2 / 24


EFFECT = Effect(
    id="cable-sag",
    stage=Stage.CABLE,
    parameters=(
        Parameter(
            "mass_per_length",
            "kg/m",
            null=0.0,
            typical=0.14,
            low=0.0,
            high=50.0,
            plausible=Plausible(0.0, 20.0, "a steel cable of 70 mm has 20 kg/m"),
        ),
    ),
    apply=apply,
    outputs=("cable_length",),
    variable="load",
    what="The cable's own weight bends it; the straight distance is shorter than the cable.",
    formula="ℓ − w² ℓ³ cos²(inclination) / 24 T², w weight per length",
    source="parabola for a shallow catenary (Irvine, Cable Structures)",
    looks_like="A length error only near slack and on long cables, in proportion to ℓ³/T².",
    confused_with=("cable-elongation-linear", "cable-elongation-exponential"),
    told_apart="Low tension over the full stroke; a hanging cable does not sag.",
    needs=("cable_force",),
    order=4,
    probes=({"mass_per_length": 0.14},),
)
