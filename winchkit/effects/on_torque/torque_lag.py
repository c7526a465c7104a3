"""torque-lag: low-pass filter of the drive's reported torque."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.recurrence import first_order_lag
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque signal after a first-order filter that starts at the first value."""
    return first_order_lag(torque, at.time, values["time_constant"])


def undo(reported: Array, time: Array, values: Values) -> Array:
    """The torque before the filter, m + τ_f m'."""
    return reported + values["time_constant"] * np.gradient(reported, time)


EFFECT = Effect(
    id="torque-lag",
    stage=Stage.TORQUE_SIGNAL,
    parameters=(
        Parameter(
            "time_constant",
            "s",
            null=0.0,
            typical=0.02,
            low=0.0,
            high=10.0,
            plausible=Plausible(
                0.0, 0.2, "a filter, a bus and a logger delay by a tenth of a second"
            ),
        ),
    ),
    apply=apply,
    undo=undo,
    outputs=("motor_torque",),
    what="The drive low-passes its torque signal, which delays and smooths it.",
    formula="τ_f m' + m = τ",
    source="first-order filter, exact for a signal linear between samples",
    looks_like="A torque error in proportion to the rate of the torque.",
    confused_with=("rotor-inertia", "motor-coulomb"),
    told_apart="Fast moves under two loads.",
)
