"""cable-hysteresis: friction between strands, so that the strain depends on the tension's path."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.derivatives import with_turning_points
from winchkit.model.friction import dahl
from winchkit.model.recurrence import share
from winchkit.model.stages import At, Stage

_STUCK = 0.5
"""Share of a change of the elastic strain that is withheld right after a reversal, when all strands
stick (rule of thumb: twice the stiffness; at 0.05 the loop would need 10 times its tension range to
close)."""


def apply(length: Array, at: At, values: Values) -> Array:
    """Length less the strain that the cable's internal friction withholds.

    The friction takes half of a change of tension from rest, and all of it right after a full
    reversal, where the strands stick.
    """
    if values["fraction"] == 0.0:
        return length
    tension, own = with_turning_points(at.tension)
    limit = values["fraction"] * np.abs(tension)
    held = dahl(tension, limit, _STUCK, start=values["start"])[own]
    return length - at.stressed_length * held / values["stiffness"]


def carried(after: Array, before: Array, at: At, values: Values) -> Array:
    """F/F_c at the last sample."""
    limit = (
        values["fraction"] * np.abs(at.tension[-1]) * at.stressed_length[-1] / values["stiffness"]
    )
    return share(before[-1] - after[-1], limit)


EFFECT = Effect(
    id="cable-hysteresis",
    stage=Stage.CABLE,
    parameters=(
        Parameter("stiffness", "N", null=2e5, typical=2e5, low=1e3, high=1e9, role="shape"),
        Parameter(
            "fraction",
            "1",
            null=0.0,
            typical=0.05,
            low=0.0,
            high=0.9,
            plausible=Plausible(0.0, 0.5, "a cable loses less than half of its elastic force"),
        ),
        Parameter("start", "1", null=0.0, typical=0.5, low=-1.0, high=1.0, role="fixed"),
    ),
    apply=apply,
    outputs=("cable_length",),
    what="Friction between strands withholds strain: loading and unloading differ.",
    formula="ℓ − ℓ_s F/EA, dF/dT = ½ (1 − s F/F_c), F_c = fraction·T; start: F/F_c at the start",
    source="Dahl friction (Cable-winding device, Eq. 25) over the tension, without its mean",
    looks_like="A hysteresis loop of the length error over the tension, at any rate.",
    confused_with=("cable-creep", "drum-winding-tension", "gear-backlash"),
    told_apart="The same tension cycle at two rates: creep changes its loop, hysteresis not.",
    needs=("cable_force",),
    order=1,
    memory=True,
    carry=carried,
    probes=({"fraction": 0.02}, {"fraction": 0.1}),
)
