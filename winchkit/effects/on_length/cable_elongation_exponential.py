"""cable-elongation-exponential: the stiffness of the cable grows with its tension."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage


def apply(length: Array, at: At, values: Values) -> Array:
    """Length with the strain k ln(1 + T/F0); a slack cable has none."""
    tight = np.log1p(np.maximum(at.tension, 0.0) / values["force_scale"])
    return length + at.stressed_length * values["strain_scale"] * tight


EFFECT = Effect(
    id="cable-elongation-exponential",
    stage=Stage.CABLE,
    parameters=(
        Parameter("strain_scale", "1", null=0.0, typical=1e-3, low=0.0, high=0.2),
        Parameter(
            "force_scale",
            "N",
            null=200.0,
            typical=200.0,
            low=1.0,
            high=1e6,
            role="shape",
            grid=(30.0, 100.0, 300.0, 1e3, 3e3),
        ),
    ),
    apply=apply,
    outputs=("cable_length",),
    variable="load",
    reduces_to=("cable-elongation-linear",),
    what="The cable's stiffness grows in proportion to its tension.",
    formula="ℓ + ℓ_s k ln(1 + T/F0), hence T = F0 (exp(ε/k) − 1)",
    source="IPAnema 3 paper, Eq. 6, re-based to zero strain at zero tension",
    looks_like="Large strain at low tension, little more at high tension.",
    confused_with=(
        "cable-elongation-linear",
        "cable-elongation-quartic",
        "cell-nonlinearity",
    ),
    told_apart="At least four loads, the lowest near slack.",
    family="cable law",
    contains=("cable-elongation-linear",),
    needs=("cable_force",),
    on_robot=frozenset({"all"}),
)
