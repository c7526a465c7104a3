"""Friction and inertia of the pulleys."""

from __future__ import annotations

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.effects.on_tension.load import VISCOSITY, with_viscous_force
from winchkit.effects.presliding import START, Presliding
from winchkit.effects.transition import CABLE_TRANSITION, cable_direction
from winchkit.model.friction import capstan_ratio, coulomb_ratio, stribeck
from winchkit.model.stages import At, Stage


def _pulley_coulomb(tension: Array, at: At, values: Values) -> Array:
    """Tension after a pulley with friction μ N against the cable's motion."""
    return tension * coulomb_ratio(cable_direction(at, values) * values["friction"], at.wrap)


PULLEY_COULOMB = Effect(
    id="pulley-coulomb",
    stage=Stage.PULLEY,
    parameters=(
        Parameter(
            "friction",
            "1",
            null=0.0,
            typical=0.02,
            low=0.0,
            high=0.5,
            plausible=Plausible(0.0, 0.3, "bearings 0.001 to 0.02, a stuck sheave 0.3"),
        ),
        CABLE_TRANSITION,
    ),
    apply=_pulley_coulomb,
    outputs=("tension", "motor_torque"),
    variable="direction",
    what="Bearing friction in proportion to the force on the bearing, equal on all pulleys.",
    formula="T1 = T0 + s μ N, N = √(T0² − 2 T0 T1 cos α + T1²)",
    source="Cable-winding device, Eq. 20–23, solved in closed form; about 0.02 per sheave",
    looks_like="A step of the tension error with the direction, in proportion to the tension.",
    confused_with=("pulley-capstan", "pulley-dahl", "pulley-stribeck", "gear-efficiency"),
    told_apart="Change a wrap angle (capstan); very slow ramps and short reversals (the others).",
    family="pulley friction",
    needs=("pulley", "load"),
)


def _pulley_capstan(tension: Array, at: At, values: Values) -> Array:
    """Tension after a wrap with Euler-Eytelwein friction."""
    return tension * capstan_ratio(cable_direction(at, values) * values["friction"], at.wrap)


PULLEY_CAPSTAN = Effect(
    id="pulley-capstan",
    stage=Stage.PULLEY,
    parameters=(
        Parameter(
            "friction",
            "1",
            null=0.0,
            typical=0.02,
            low=0.0,
            high=1.0,
            plausible=Plausible(0.0, 0.6, "cables on metal and plastics 0.05 to 0.6"),
        ),
        CABLE_TRANSITION,
    ),
    apply=_pulley_capstan,
    outputs=("tension", "motor_torque"),
    variable="direction",
    what="A stuck pulley or an eyelet: friction grows with the angle of wrap.",
    formula="T1 = T0 exp(s μ α)",
    source="Euler-Eytelwein; Cable-winding device, Eq. 19",
    looks_like="A step of the tension error with the direction, in proportion to the tension.",
    confused_with=("pulley-coulomb",),
    told_apart="Change a wrap angle; at fixed wraps the two are the same.",
    family="pulley friction",
    needs=("pulley", "load"),
)


PULLEY_VISCOUS = Effect(
    id="pulley-viscous",
    stage=Stage.PULLEY,
    parameters=(VISCOSITY,),
    apply=with_viscous_force,
    outputs=("tension", "motor_torque"),
    variable="speed",
    what="Grease and seals of every pulley have friction in proportion to the cable speed.",
    formula="T1 = T0 + c v",
    source="viscous friction",
    looks_like="A tension error that is odd and linear in the speed, at any load.",
    confused_with=("load-viscous", "pulley-coulomb", "pulley-stribeck"),
    told_apart="A ladder of speeds in both directions.",
    needs=("pulley", "load"),
    order=1,
)


def _pulley_stribeck(tension: Array, at: At, values: Values) -> Array:
    """Tension after a pulley whose friction falls from μs to μc with the speed."""
    friction = stribeck(at.speed, values["coulomb"], values["static"], values["stribeck_speed"])
    return tension * coulomb_ratio(cable_direction(at, values) * friction, at.wrap)


def _sticks(values: Values) -> bool:
    """Whether friction at standstill is at least that in motion, as with a film of grease."""
    return values["static"] >= values["coulomb"]


PULLEY_STRIBECK = Effect(
    id="pulley-stribeck",
    stage=Stage.PULLEY,
    parameters=(
        Parameter("coulomb", "1", null=0.0, typical=0.02, low=0.0, high=0.5),
        Parameter("static", "1", null=0.0, typical=0.03, low=0.0, high=0.5),
        Parameter(
            "stribeck_speed",
            "m/s",
            null=0.02,
            typical=0.02,
            low=2e-3,
            high=1.0,
            role="shape",
            grid=(5e-3, 0.015, 0.05, 0.15),
        ),
        CABLE_TRANSITION,
    ),
    apply=_pulley_stribeck,
    outputs=("tension", "motor_torque"),
    variable="speed",
    reduces_to=("pulley-coulomb", "pulley-capstan"),
    what="Bearing friction is higher at low speed, before a film of grease builds up.",
    formula="T1 = T0 + s N (μc + (μs − μc) exp(−(v/vs)²))",
    source="Stribeck curve (Armstrong-Hélouvry et al. 1994) with Eq. 22 for N",
    looks_like="Friction with an excess at low speed, in proportion to the tension.",
    confused_with=("pulley-dahl", "pulley-coulomb"),
    told_apart="Very slow ramps, at several speeds from 1 to 100 mm/s.",
    family="pulley friction",
    contains=("pulley-coulomb", "pulley-capstan"),
    needs=("pulley", "load"),
    possible=_sticks,
)


def _pulley_dahl_limit(tension: Array, at: At, values: Values) -> Array:
    """F_c = μ N, the Coulomb friction of this pulley, N."""
    return np.abs(tension) * (coulomb_ratio(values["friction"], at.wrap) - 1.0)


def _wound_in(at: At) -> Array:
    return -at.free_length


def _pulley_dahl_stiffness(values: Values) -> float:
    return values["stiffness"]


FRICTION = Presliding("friction", _pulley_dahl_limit, _wound_in, _pulley_dahl_stiffness)

PULLEY_DAHL = Effect(
    id="pulley-dahl",
    stage=Stage.PULLEY,
    parameters=(
        Parameter("friction", "1", null=0.0, typical=0.02, low=0.0, high=0.5),
        Parameter(
            "stiffness",
            "N/m",
            null=2e3,
            typical=2e3,
            low=0.1,
            high=1e7,
            role="shape",
            grid=(300.0, 1e3, 3e3, 1e4),
        ),
        Parameter("shape", "1", null=1.0, typical=1.0, low=0.0, high=3.0, role="fixed"),
        START,
    ),
    apply=FRICTION.apply,
    outputs=("tension", "motor_torque"),
    reduces_to=("pulley-coulomb", "pulley-capstan"),
    what="Cable and bearing deform elastically before they slide, equally on all pulleys.",
    formula="dF/dx = σ |1 − s F/F_c|^β sgn(1 − s F/F_c), F_c = μ N; start: F/F_c at the start",
    source="Cable-winding device, Eq. 25 with absolute value; exact step for any β",
    looks_like="Friction that builds up after a reversal, over distance and not over time.",
    confused_with=("pulley-coulomb", "pulley-stribeck", "gear-backlash"),
    told_apart="Short reversals of a few millimetres at two speeds.",
    family="pulley friction",
    contains=("pulley-coulomb", "pulley-capstan"),
    needs=("pulley", "load"),
    memory=True,
    carry=FRICTION.carried,
    dynamics=FRICTION.dynamics,
)


def _pulley_inertia(tension: Array, at: At, values: Values) -> Array:
    return tension + values["equivalent_mass"] * np.gradient(at.speed, at.time)


PULLEY_INERTIA = Effect(
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
    apply=_pulley_inertia,
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
