"""Effects on the torque that the drive reports: constant, ripple, lag, lead."""

from __future__ import annotations

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import (
    MOTOR_ORDERS,
    Effect,
    Parameter,
    Plausible,
    Values,
    order_per_turn,
    with_gain,
)
from winchkit.model.derivatives import shifted
from winchkit.model.recurrence import first_order_lag
from winchkit.model.stages import At, Stage

TORQUE_CONSTANT = Effect(
    id="torque-constant",
    stage=Stage.TORQUE_CONSTANT,
    parameters=(
        Parameter(
            "gain_error",
            "1",
            null=0.0,
            typical=0.03,
            low=-0.9,
            high=10.0,
            plausible=Plausible(
                -0.5, 0.5, "temperature, tolerance, and peak for rms values (√2) are within ±50 %"
            ),
        ),
    ),
    apply=with_gain,
    outputs=("motor_torque",),
    variable="load",
    what="The drive's torque constant or rated torque is wrong, or the magnets are warm.",
    formula="(1 + g) τ",
    source="motor data sheets give ±10 %",
    looks_like="A torque error in proportion to the load, equal in both directions.",
    confused_with=("gear-efficiency", "cell-gain", "drum-radius"),
    told_apart="Several loads in both directions; the length excludes a wrong drum radius.",
    needs=("cable_force",),
)


_UNIT_TORQUE = 1.0
"""N m, convention: the parameter is the error there."""


def _torque_saturation(torque: Array, at: At, values: Values) -> Array:
    return torque + values["cubic"] * (torque / _UNIT_TORQUE) ** 3


TORQUE_SATURATION = Effect(
    id="torque-saturation",
    stage=Stage.TORQUE_CONSTANT,
    parameters=(Parameter("cubic", "N m", null=0.0, typical=0.1, low=-1e6, high=1e6),),
    apply=_torque_saturation,
    outputs=("motor_torque",),
    variable="load",
    what="The iron of the motor saturates: the torque constant falls with the current.",
    formula="τ + k (τ/1 N m)³, τ the torque by the constant of small currents",
    source="torque over current of data sheets, first odd term beside the proportional one",
    looks_like="A torque error that grows faster than the load, equal in both directions.",
    confused_with=("torque-constant", "gear-efficiency"),
    told_apart="Three loads at least, up to the motor's peak torque.",
    needs=("cable_force",),
    order=1,
)


def _torque_ripple(torque: Array, at: At, values: Values) -> Array:
    wave = np.sin(values["order"] * at.motor_angle + values["phase"])
    return torque * (1.0 + values["amplitude"] * wave)


TORQUE_RIPPLE = Effect(
    id="torque-ripple",
    stage=Stage.TORQUE_SIGNAL,
    parameters=(
        # Above 1 the torque constant would change its sign within a turn.
        Parameter("amplitude", "1", null=0.0, typical=0.02, low=0.0, high=1.0),
        Parameter("phase", "rad", null=0.0, typical=1.0),
        order_per_turn(MOTOR_ORDERS, typical=2.0),
    ),
    apply=_torque_ripple,
    outputs=("motor_torque",),
    variable="motor_angle",
    what="The torque constant depends on the rotor's position, by its poles and the inverter.",
    formula="(1 + a sin(k θ + p)) τ, k from pole pairs and slots",
    source="mutual torque ripple of permanent-magnet motors (Jahns, Soong 1996)",
    looks_like="A ripple of the torque over the motor angle, in proportion to the torque; none in "
    "length.",
    confused_with=("gear-transmission-error", "motor-cogging"),
    told_apart="Two loads: cogging does not grow with the load. The length: a transmission error "
    "is in it too.",
    order=-1,
    polar=("amplitude", "phase"),
    repeatable=True,
)


def _torque_lag(torque: Array, at: At, values: Values) -> Array:
    """Torque signal after a first-order filter that starts at the first value."""
    return first_order_lag(torque, at.time, values["time_constant"])


def _torque_lag_undo(reported: Array, time: Array, values: Values) -> Array:
    """The torque before the filter, m + τ_f m'."""
    return reported + values["time_constant"] * np.gradient(reported, time)


TORQUE_LAG = Effect(
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
    apply=_torque_lag,
    undo=_torque_lag_undo,
    outputs=("motor_torque",),
    what="The drive low-passes its torque signal, which delays and smooths it.",
    formula="τ_f m' + m = τ",
    source="first-order filter, exact for a signal linear between samples",
    looks_like="A torque error in proportion to the rate of the torque.",
    confused_with=("torque-lead", "rotor-inertia", "motor-coulomb"),
    told_apart="Fast moves under two loads.",
)


def _torque_lead(torque: Array, at: At, values: Values) -> Array:
    """Torque after the delay of the drive, or before that of its signal."""
    return shifted(torque, at.time, values["lead"])


def _torque_lead_undo(reported: Array, time: Array, values: Values) -> Array:
    """The motor's torque follows the command."""
    return shifted(reported, time, -values["lead"])


TORQUE_LEAD = Effect(
    id="torque-lead",
    stage=Stage.TORQUE_SIGNAL,
    parameters=(
        Parameter(
            "lead",
            "s",
            null=0.0,
            typical=5e-3,
            low=-2.0,
            high=2.0,
            plausible=Plausible(
                -0.2, 0.2, "a drive, a bus and a logger delay by a tenth of a second"
            ),
        ),
    ),
    apply=_torque_lead,
    undo=_torque_lead_undo,
    outputs=("motor_torque",),
    what="The torque signal is early, as the commanded torque (0x6074), which the actual one "
    "(0x6077) follows with the delay of bus and control loop; or late (negative), as behind a bus.",
    formula="m(t) = τ(t + δ)",
    source="definition of a delay; observed on EMPS (Janot et al. 2019), where the record is the "
    "command",
    looks_like="A torque error in proportion to the rate of the torque.",
    confused_with=("torque-lag", "rotor-inertia"),
    told_apart="Fast moves under two loads, with the drive's actual and commanded torque.",
)
