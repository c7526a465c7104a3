"""Friction of the motor side that is independent of the load."""

from __future__ import annotations

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
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


_WHERE_OILS_ARE_NAMED = 40.0
"""Degrees Celsius, convention; another shifts the viscosity, which is fitted beside it."""
_WARMER = 10.0
"""K, convention: the parameter is the change of the viscosity over ten degrees."""


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


def _viscous_thermal(torque: Array, at: At, values: Values) -> Array:
    warmth = (at.temperature - _WHERE_OILS_ARE_NAMED) / _WARMER
    return torque + values["viscosity_change"] * warmth * at.motor_rate


VISCOUS_THERMAL = Effect(
    id="viscous-thermal",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("viscosity_change", "N m s", null=0.0, typical=-3e-4, low=-1e6, high=1e6),
    ),
    apply=_viscous_thermal,
    outputs=("motor_torque",),
    variable="temperature",
    what="The viscous friction changes with the temperature: oil and grease thin as they warm.",
    formula="τ + k θ' (temperature − 40 °C)/10 K",
    source="viscosity of oils over temperature (ISO 3448: at 40 °C), linear",
    looks_like="A torque error in proportion to the speed that shrinks as the machine warms.",
    confused_with=("motor-viscous", "friction-growth"),
    told_apart="The same motion cold and warm, at two speeds.",
    family="motor friction",
    needs=("temperature",),
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
