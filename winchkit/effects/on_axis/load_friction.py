"""Friction of an axis in proportion to the torque of its load: weight, springs and a cable.

The inertia is no part of that torque but in one law, which has the share of it that the gear
transmits; the rest is the rotor's.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.effects.transition import MOTOR_TRANSITION, motor_direction
from winchkit.model.stages import At, Stage

_SHARE = Parameter(
    "share", "1", null=0.0, typical=0.1, low=0.0, high=5.0,
    plausible=Plausible(0.0, 0.9, "a worm gear loses two thirds"),
)  # fmt: skip


def _friction_of_load(torque: Array, at: At, values: Values) -> Array:
    return torque + values["share"] * motor_direction(at, values) * np.abs(torque)


FRICTION_OF_LOAD = Effect(
    id="friction-of-load",
    stage=Stage.MOTOR,
    parameters=(
        _SHARE,
        MOTOR_TRANSITION,
    ),
    apply=_friction_of_load,
    outputs=("motor_torque",),
    what="Friction of teeth and bearings in proportion to the torque of the load.",
    formula="τ + s μ |τ|, τ the torque of the load",
    source="load-dependent friction of robot joints (Bittencourt, Gunnarsson 2012) and of servos "
    "(Duclusaud et al. 2024)",
    looks_like="A step of the torque error with the direction, in proportion to the load.",
    confused_with=("friction-of-torque", "motor-coulomb", "stribeck-of-load"),
    told_apart="Two loads in both directions, one of them near zero.",
    needs=("ungeared",),
    family="load friction",
    order=-1,
)  # fmt: skip


def _friction_of_transmission(torque: Array, at: At, values: Values) -> Array:
    inertia = values["inertia_share"] * (at.profile.motor.inertia or 0.0)
    transmitted = torque + inertia * at.motor_acceleration
    return torque + values["share"] * motor_direction(at, values) * np.abs(transmitted)


FRICTION_OF_TRANSMISSION = Effect(
    id="friction-of-transmission",
    stage=Stage.MOTOR,
    parameters=(
        _SHARE,
        # An inertia of the profile that is too small makes the share larger than one.
        Parameter(
            "inertia_share", "1", null=1.0, typical=0.5, low=0.0, high=10.0,
            role="shape", grid=(0.3, 1.0),
        ),
        MOTOR_TRANSITION,
    ),
    apply=_friction_of_transmission,
    outputs=("motor_torque",),
    reduces_to=("friction-of-load",),
    what="Friction of teeth and bearings in proportion to the torque that they transmit to weight "
    "and inertia.",
    formula="τ + s μ |τ + λ J θ''|, τ the torque of the load, J the inertia of the profile",
    source="load-dependent friction of robot joints (Bittencourt, Gunnarsson 2012), with the "
    "inertia of the load",
    looks_like="A step of the torque error with the direction, in proportion to the load, larger "
    "where the axis accelerates.",
    confused_with=("friction-of-load", "friction-of-torque", "motor-coulomb"),
    told_apart="Fast moves where the weight is balanced; slow ones have the friction of the load.",
    needs=("ungeared", "inertia"),
    family="load friction",
    order=-1,
)  # fmt: skip


def _friction_of_torque(torque: Array, at: At, values: Values) -> Array:
    """Torque τ/(1 − s μ sgn τ), which is τ plus s μ of the magnitude of the result."""
    return torque / (1.0 - values["share"] * motor_direction(at, values) * np.sign(torque))


FRICTION_OF_TORQUE = Effect(
    id="friction-of-torque",
    stage=Stage.MOTOR,
    parameters=(
        replace(_SHARE, high=0.95),
        MOTOR_TRANSITION,
    ),
    apply=_friction_of_torque,
    outputs=("motor_torque",),
    what="Friction of teeth and bearings in proportion to the torque of the motor.",
    formula="τ/(1 − s μ sgn τ): τ_m = τ + s μ |τ_m|, τ the torque of the load",
    source="directional load-dependent friction of servos (Duclusaud et al. 2024)",
    looks_like="A step of the torque error with the direction, larger where the motor drives the "
    "load than where the load drives the motor.",
    confused_with=("friction-of-load", "motor-coulomb"),
    told_apart="Two loads in both directions, one of them near zero.",
    needs=("ungeared",),
    family="load friction",
    order=-1,
)  # fmt: skip


def _stribeck_of_load(torque: Array, at: At, values: Values) -> Array:
    fallen = np.exp(-((at.motor_rate / values["stribeck_speed"]) ** 2))
    return torque + values["share"] * motor_direction(at, values) * fallen * np.abs(torque)


STRIBECK_OF_LOAD = Effect(
    id="stribeck-of-load",
    stage=Stage.MOTOR,
    parameters=(
        _SHARE,
        Parameter(
            "stribeck_speed", "rad/s", null=5.0, typical=5.0, low=0.05, high=1e3,
            role="shape", grid=(0.3, 3.0, 30.0),
        ),
        MOTOR_TRANSITION,
    ),
    apply=_stribeck_of_load,
    outputs=("motor_torque",),
    reduces_to=("friction-of-load",),
    what="Friction of teeth in proportion to the torque of the load is higher at low speed.",
    formula="τ + s μ |τ| exp(−(θ'/ω_s)²), τ the torque of the load",
    source="load-dependent Stribeck friction of robot joints (Bittencourt, Gunnarsson 2012)",
    looks_like="Additional torque against the motion at low speed, in proportion to the load.",
    confused_with=("friction-of-load", "motor-stribeck"),
    told_apart="Slow ramps at several speeds with two loads.",
    needs=("ungeared",),
    family="load friction",
    order=-1,
)  # fmt: skip
