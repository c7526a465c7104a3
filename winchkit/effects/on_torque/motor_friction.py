"""Friction of the motor side that is independent of the load."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.effects.location import GRID_OF_PLACES, window
from winchkit.effects.presliding import START, Presliding, sliding_distance
from winchkit.effects.transition import MOTOR_TRANSITION, motor_direction
from winchkit.model.stages import At, Stage


def _motor_coulomb(torque: Array, at: At, values: Values) -> Array:
    return torque + values["torque"] * motor_direction(at, values)


MOTOR_COULOMB = Effect(
    id="motor-coulomb",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("torque", "N m", null=0.0, typical=0.02, low=0.0, high=1e6),
        MOTOR_TRANSITION,
    ),
    apply=_motor_coulomb,
    outputs=("motor_torque",),
    variable="direction",
    what="Coulomb friction of bearings, seals and gears, independent of the load.",
    formula="τ + s c",
    source="Coulomb friction",
    looks_like="A step of the torque error with the direction, the same at every load.",
    confused_with=("gear-efficiency", "motor-stribeck", "motor-viscous", "motor-dahl"),
    told_apart="Two loads in both directions; a ladder of speeds.",
    family="motor friction",
)


def _motor_coulomb_asymmetry(torque: Array, at: At, values: Values) -> Array:
    return torque + values["offset"]


MOTOR_COULOMB_ASYMMETRY = Effect(
    id="motor-coulomb-asymmetry",
    stage=Stage.MOTOR,
    parameters=(Parameter("offset", "N m", null=0.0, typical=0.01, low=-1e6, high=1e6),),
    apply=_motor_coulomb_asymmetry,
    outputs=("motor_torque",),
    what="Coulomb friction depends on the direction, or the torque signal has an offset.",
    formula="τ + o, o = (c₊ − c₋)/2",
    source="Coulomb friction, one value per direction",
    looks_like="A constant torque error.",
    confused_with=("torque-constant", "motor-coulomb"),
    told_apart="Two loads: a wrong torque constant grows with them.",
    family="motor friction",
)


def _motor_viscous(torque: Array, at: At, values: Values) -> Array:
    return torque + values["viscosity"] * at.motor_rate


MOTOR_VISCOUS = Effect(
    id="motor-viscous",
    stage=Stage.MOTOR,
    parameters=(Parameter("viscosity", "N m s", null=0.0, typical=1e-3, low=0.0, high=1e6),),
    apply=_motor_viscous,
    outputs=("motor_torque",),
    variable="speed",
    what="Losses by grease, eddy currents and windage in proportion to the speed.",
    formula="τ + b θ'",
    source="viscous friction",
    looks_like="A torque error that is odd and linear in the motor's speed.",
    confused_with=("motor-coulomb", "pulley-viscous"),
    told_apart="A ladder of speeds in both directions.",
    family="motor friction",
)


def _motor_viscous_asymmetry(torque: Array, at: At, values: Values) -> Array:
    return torque + values["viscosity_difference"] * np.abs(at.motor_rate)


MOTOR_VISCOUS_ASYMMETRY = Effect(
    id="motor-viscous-asymmetry",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("viscosity_difference", "N m s", null=0.0, typical=3e-4, low=-1e6, high=1e6),
    ),
    apply=_motor_viscous_asymmetry,
    outputs=("motor_torque",),
    variable="speed",
    what="Viscous friction of preloaded screws, worms and lip seals depends on the direction.",
    formula="τ + d |θ'|, d = (b₊ − b₋)/2",
    source="viscous friction, one value per direction; observed on EMPS (Janot et al. 2019)",
    looks_like="A torque error that is even in the motor's speed and linear in it.",
    confused_with=("motor-coulomb-asymmetry", "motor-viscous"),
    told_apart="A ladder of speeds in both directions: an offset is the same at every speed.",
    family="motor friction",
)


def _motor_stribeck(torque: Array, at: At, values: Values) -> Array:
    return torque + values["torque"] * motor_direction(at, values) * np.exp(
        -((at.motor_rate / values["stribeck_speed"]) ** 2)
    )


MOTOR_STRIBECK = Effect(
    id="motor-stribeck",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("torque", "N m", null=0.0, typical=0.02, low=0.0, high=1e6),
        Parameter(
            "stribeck_speed",
            "rad/s",
            null=5.0,
            typical=5.0,
            low=0.05,
            high=1e3,
            role="shape",
            grid=(1.0, 4.0, 15.0, 50.0),
        ),
        MOTOR_TRANSITION,
    ),
    apply=_motor_stribeck,
    outputs=("motor_torque",),
    variable="speed",
    reduces_to=("motor-coulomb",),
    what="Friction of bearings and seals is higher at low speed, before a film builds up.",
    formula="τ + s b exp(−(θ'/ω_s)²)",
    source="Stribeck curve (Armstrong-Hélouvry et al. 1994)",
    looks_like="Additional torque against the motion at low speed only.",
    confused_with=("motor-coulomb", "pulley-stribeck"),
    told_apart="Very slow ramps at several speeds.",
    family="motor friction",
)


def _motor_dahl_limit(torque: Array, at: At, values: Values) -> Array:
    """F_c = c at every sample, N m."""
    return np.full_like(torque, values["torque"])


def _motor_angle(at: At) -> Array:
    return at.motor_angle


def _motor_dahl_stiffness(values: Values) -> float:
    """σ = c/δ, N m/rad."""
    return values["torque"] / values["distance"]


FRICTION = Presliding("torque", _motor_dahl_limit, _motor_angle, _motor_dahl_stiffness)

MOTOR_DAHL = Effect(
    id="motor-dahl",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("torque", "N m", null=0.0, typical=0.02, low=0.0, high=1e6),
        sliding_distance("teeth, seals and bearings"),
        START,
    ),
    apply=FRICTION.apply,
    outputs=("motor_torque",),
    reduces_to=("motor-coulomb",),
    what="Teeth, seals and bearings deform elastically before they slide.",
    formula="τ + F, dF/dθ = (c − s F)/δ, δ the distance; start: F/c at the start",
    source="Dahl 1968; presliding of a joint (Armstrong-Hélouvry et al. 1994)",
    looks_like="A torque error of Coulomb friction that builds up over an angle after a reversal.",
    confused_with=("motor-coulomb", "motor-stribeck", "torque-lag"),
    told_apart="Reversals at two speeds: presliding ends after an angle, a lag after a time.",
    family="motor friction",
    contains=("motor-coulomb",),
    memory=True,
    carry=FRICTION.carried,
    dynamics=FRICTION.dynamics,
)


def _motor_lugre_limit(torque: Array, at: At, values: Values) -> Array:
    """F_c = c (1 + r exp(−(θ'/ω_s)²)), N m."""
    fallen = np.exp(-((at.motor_rate / values["stribeck_speed"]) ** 2))
    return values["torque"] * (1.0 + values["static_share"] * fallen)


BRISTLES = Presliding("torque", _motor_lugre_limit, _motor_angle, _motor_dahl_stiffness)

MOTOR_LUGRE = Effect(
    id="motor-lugre",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("torque", "N m", null=0.0, typical=0.02, low=0.0, high=1e6),
        Parameter(
            "static_share", "1", null=0.5, typical=0.5, low=0.0, high=5.0, role="shape",
            plausible=Plausible(0.0, 3.0, "friction at rest is up to four times that of sliding"),
        ),
        Parameter(
            "stribeck_speed", "rad/s", null=5.0, typical=5.0, low=0.05, high=1e3,
            role="shape", grid=(4.0, 15.0),
        ),
        replace(sliding_distance("teeth, seals and bearings"), grid=(0.004, 0.016, 0.064)),
        START,
    ),
    apply=BRISTLES.apply,
    outputs=("motor_torque",),
    reduces_to=("motor-dahl", "motor-coulomb"),
    what="Teeth, seals and bearings deform before they slide, and slide easier at speed.",
    formula="τ + F, dF/dθ = c/δ (1 − s F/g), g = c (1 + r exp(−(θ'/ω_s)²)); start: F/g at first",
    source="LuGre model without damping (Canudas de Wit et al. 1995)",
    looks_like="Presliding after a reversal, and a torque against the motion that falls with the "
    "speed.",
    confused_with=("motor-dahl", "motor-stribeck"),
    told_apart="Small reversals, and slow ramps at several speeds.",
    family="motor friction",
    contains=("motor-coulomb", "motor-dahl", "motor-stribeck"),
    memory=True,
    carry=BRISTLES.carried,
    dynamics=BRISTLES.dynamics,
)  # fmt: skip


def _friction_at_place(torque: Array, at: At, values: Values) -> Array:
    return torque + values["torque"] * motor_direction(at, values) * window(at.drum_angle, values)


FRICTION_AT_PLACE = Effect(
    id="friction-at-place",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("torque", "N m", null=0.0, typical=0.02, low=0.0, high=1e6),
        Parameter(
            "place", "rad", null=0.0, typical=1.0, low=-1e6, high=1e6,
            role="shape", grid=GRID_OF_PLACES, over="drum_angle",
        ),
        Parameter(
            "width", "rad", null=1.0, typical=1.0, low=1e-4, high=1e5,
            role="shape", grid=(1 / 12,), along="drum_angle",
        ),
        MOTOR_TRANSITION,
    ),
    apply=_friction_at_place,
    outputs=("motor_torque",),
    reduces_to=("motor-coulomb",),
    what="Friction is larger around one position: a damaged tooth or bearing, dirt, a bent shaft.",
    formula="τ + s c exp(−((φ − φ0)/w)²), φ the drum angle since the reference",
    source="Coulomb friction with a smooth window",
    looks_like="A bump of the torque error over the position, with the sign of the direction.",
    confused_with=("load-friction-at-place", "motor-coulomb"),
    told_apart="The full stroke in both directions; that of the load is in the tension too.",
)  # fmt: skip


def _friction_growth(torque: Array, at: At, values: Values) -> Array:
    return torque + values["rate"] * at.time * motor_direction(at, values)


FRICTION_GROWTH = Effect(
    id="friction-growth",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("rate", "N m/s", null=0.0, typical=2e-4, low=-1e3, high=1e3),
        MOTOR_TRANSITION,
    ),
    apply=_friction_growth,
    outputs=("motor_torque",),
    what="Coulomb friction changes within a run: grease warms up, a seal or a brake wears.",
    formula="τ + s g t, t from the run's start",
    source="Coulomb friction with a linear trend",
    looks_like="A step of the torque error with the direction that grows with time.",
    confused_with=("motor-coulomb", "motor-viscous"),
    told_apart="A long run at one speed and load, and a repeat after a pause.",
    family="motor friction",
)
