"""cable-elongation-linear: elastic elongation in proportion to the tension."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.stages import At, Stage


def apply(length: Array, at: At, values: Values) -> Array:
    """Length with the strain T/EA over free and dead length."""
    return length + at.stressed_length * at.tension / values["axial_stiffness"]


EFFECT = Effect(
    id="cable-elongation-linear",
    stage=Stage.CABLE,
    parameters=(
        Parameter(
            "axial_stiffness",
            "N",
            null=np.inf,
            typical=2e5,
            low=1e3,
            high=np.inf,
            reciprocal=True,
            plausible=Plausible(5000.0, float("inf"), "a fibre cable of 1 mm has 10 kN"),
        ),
    ),
    apply=apply,
    outputs=("cable_length",),
    variable="load",
    what="The cable is elastic: it is longer by its strain times its stressed length.",
    formula="ℓ + ℓ_s T / EA, ℓ_s = ℓ + dead length",
    source="Hooke; IPAnema 3 paper, Eq. 4; steel EA = 50–105 GPa × fill × area",
    looks_like="A length error in proportion to tension times length.",
    confused_with=("frame-compliance", "cable-elongation-quartic", "cable-elongation-exponential"),
    told_apart="The same load at several lengths; several loads over the full stroke.",
    family="cable law",
    needs=("cable_force",),
    on_robot=frozenset({"one", "all"}),
)
