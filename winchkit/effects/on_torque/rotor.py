"""Inertia of the rotor, cogging of the motor, unbalance of the drum."""

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
)
from winchkit.model.stages import At, Stage


def _rotor_inertia(torque: Array, at: At, values: Values) -> Array:
    return torque + values["inertia"] * at.motor_acceleration


ROTOR_INERTIA = Effect(
    id="rotor-inertia",
    stage=Stage.MOTOR,
    parameters=(
        Parameter(
            "inertia",
            "kg m^2",
            null=0.0,
            typical=1e-4,
            low=0.0,
            plausible=Plausible(
                0.0, 1.0, "rotors of motors up to 100 kW are below 1 kg m²", of_winch=True
            ),
        ),
    ),
    apply=_rotor_inertia,
    outputs=("motor_torque",),
    variable="acceleration",
    what="Inertia of rotor, brake, coupling and gearbox input; of an axis, with what it moves.",
    formula="τ + J θ''",
    source="Newton",
    looks_like="Torque in proportion to the motor's acceleration, at any load.",
    confused_with=("torque-lag", "pulley-inertia"),
    told_apart="Fast and slow moves without load.",
)


def _motor_cogging(torque: Array, at: At, values: Values) -> Array:
    return torque + values["amplitude"] * np.sin(values["order"] * at.motor_angle + values["phase"])


MOTOR_COGGING = Effect(
    id="motor-cogging",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("amplitude", "N m", null=0.0, typical=0.01, low=0.0, high=1e6),
        Parameter("phase", "rad", null=0.0, typical=1.0),
        order_per_turn(MOTOR_ORDERS, typical=2.0),
    ),
    apply=_motor_cogging,
    outputs=("motor_torque",),
    variable="motor_angle",
    what="Slots and poles cause a torque that depends only on the motor angle.",
    formula="τ + a sin(k θ + p), k from poles, slots and their multiples",
    source="cogging torque of permanent-magnet motors",
    looks_like="A ripple of the torque over the motor angle, the same at every load.",
    confused_with=("gear-transmission-error",),
    told_apart="A scan of the orders under two loads: a gear's ripple grows with the load.",
    polar=("amplitude", "phase"),
    repeatable=True,
)


def _drum_unbalance(torque: Array, at: At, values: Values) -> Array:
    return torque + values["amplitude"] * np.sin(at.drum_angle + values["phase"])


DRUM_UNBALANCE = Effect(
    id="drum-unbalance",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("amplitude", "N m", null=0.0, typical=0.01, low=0.0, high=1e6),
        Parameter("phase", "rad", null=0.0, typical=1.0),
    ),
    apply=_drum_unbalance,
    outputs=("motor_torque",),
    part="drum",
    variable="drum_angle",
    what="The centre of mass of the drum is not on its axis.",
    formula="τ + a sin(φ + p), a = m g e / ratio, φ the drum angle",
    source="statics of an eccentric mass on a horizontal axis",
    looks_like="A sine once per drum turn in the torque, the same at every load.",
    confused_with=("drum-eccentricity", "motor-cogging", "joint-gravity"),
    told_apart="Two loads: the torque by an eccentric drum grows with the load, and its length has "
    "the same period.",
    needs=("half_turn",),
    polar=("amplitude", "phase"),
    order=-2,
)
