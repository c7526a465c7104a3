"""pulley-inertia: inertia of the pulleys."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.stages import At, Stage


def apply(tension: Array, at: At, values: Values) -> Array:
    """Tension plus m_eq dv/dt."""
    return tension + values["equivalent_mass"] * np.gradient(at.speed, at.time)


EFFECT = Effect(
    id="pulley-inertia",
    stage=Stage.PULLEY,
    parameters=(
        Parameter(
            "equivalent_mass",
            "kg",
            null=0.0,
            typical=0.5,
            low=0.0,
            high=1e4,
            plausible=Plausible(0.0, 200.0, "a steel sheave of 1 m has 100 kg at its rim"),
        ),
    ),
    apply=apply,
    outputs=("tension", "motor_torque"),
    variable="acceleration",
    what="The cable accelerates the inertia of the pulleys, which are equal.",
    formula="T1 = T0 + m_eq dv/dt, m_eq = J/r²",
    source="Newton",
    looks_like="A tension error in proportion to the cable's acceleration.",
    confused_with=("cell-lag", "rotor-inertia"),
    told_apart="Fast moves under two loads: a lag's error grows with the load's change.",
    needs=("pulley", "load"),
    order=2,
    left_out="the cable's acceleration is not measured; at rest it vanishes",
)
