"""cable-creep: the strain of the cable keeps changing after a step of the load."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.recurrence import first_order_lag, share
from winchkit.model.stages import At, Stage


def apply(length: Array, at: At, values: Values) -> Array:
    """Length with the creep strain over free and dead length; it starts at zero strain."""
    settled = at.tension / values["creep_stiffness"]
    begun = values["start"] * settled[0]
    strain = first_order_lag(settled, at.time, values["time_constant"], begun)
    return length + at.stressed_length * strain


def carried(after: Array, before: Array, at: At, values: Values) -> Array:
    """Strain over T/EA_c at the last sample; unchanged at zero tension."""
    settled = at.stressed_length[-1] * at.tension[-1] / values["creep_stiffness"]
    return share(after[-1] - before[-1], settled, values["start"])


EFFECT = Effect(
    id="cable-creep",
    stage=Stage.CABLE,
    parameters=(
        Parameter(
            "creep_stiffness",
            "N",
            null=np.inf,
            typical=1e6,
            low=1e3,
            high=np.inf,
            reciprocal=True,
        ),
        Parameter(
            "time_constant",
            "s",
            null=60.0,
            typical=60.0,
            low=0.5,
            high=1e5,
            role="shape",
            grid=(5.0, 20.0, 60.0, 200.0, 1000.0),
        ),
        Parameter("start", "1", null=0.0, typical=0.5, low=-1.0, high=2.0, role="fixed"),
    ),
    apply=apply,
    outputs=("cable_length",),
    reduces_to=("cable-elongation-linear",),
    what="Fibres and strands settle: strain follows the tension with a time constant.",
    formula="ε' = (T/EA_c − ε)/τ; start: ε over T/EA_c at the run's start",
    source="Kelvin-Voigt element; polymer cables creep up to 15 % (s00542-019-04554-5)",
    looks_like="The length drifts after a step of the load and levels off.",
    confused_with=("cable-thermal", "cable-hysteresis", "encoder-slip"),
    told_apart="Hold after a load step, then unload; temperature up and down at constant load.",
    needs=("cable_force",),
    order=2,
    memory=True,
    carry=carried,
    rested=1.0,
)
