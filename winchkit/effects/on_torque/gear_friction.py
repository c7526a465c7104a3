"""Friction of the gear in proportion to the load."""

from __future__ import annotations

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Dynamics, Effect, Parameter, Plausible, Values
from winchkit.effects.presliding import START, sliding_distance
from winchkit.effects.transition import CABLE_TRANSITION, cable_direction
from winchkit.model.friction import dahl
from winchkit.model.stages import At, Stage


def _gear_efficiency(torque: Array, at: At, values: Values) -> Array:
    """Torque τ η^(−s): more winding in, less paying out."""
    return torque * values["efficiency"] ** -cable_direction(at, values)


EFFICIENCY = Parameter(
    "efficiency",
    "1",
    null=1.0,
    typical=0.9,
    low=0.05,
    high=1.0,
    plausible=Plausible(0.2, 1.0, "a worm gear has 0.3"),
)
"""Output power over input power of a gear."""

GEAR_EFFICIENCY = Effect(
    id="gear-efficiency",
    stage=Stage.GEARBOX,
    parameters=(EFFICIENCY, CABLE_TRANSITION),
    apply=_gear_efficiency,
    outputs=("motor_torque",),
    variable="direction",
    what="Tooth friction in proportion to the load: more motor torque winding in, less paying out.",
    formula="τ/η winding in, τ η paying out, smooth between",
    source="Cable-winding device, Eq. 10: 0.68 over six bearings and a belt",
    looks_like="A step of the torque error with the direction, in proportion to the load.",
    confused_with=("torque-constant", "motor-coulomb", "pulley-coulomb", "gear-dahl"),
    told_apart="Two loads in both directions.",
    family="gear friction",
    needs=("cable_force", "gearing"),
)


def _gear_dahl_state(at: At, values: Values) -> Array:
    """State z, from −1 paying out to 1 winding in."""
    wound_in = at.wound_angle * at.profile.gearbox.ratio
    return dahl(wound_in, np.ones(len(wound_in)), 1 / values["distance"], start=values["start"])


def _gear_dahl(torque: Array, at: At, values: Values) -> Array:
    """Torque τ η^(−z)."""
    return np.asarray(torque * values["efficiency"] ** -_gear_dahl_state(at, values))


def _gear_dahl_carry(after: Array, before: Array, at: At, values: Values) -> Array:
    """State z at the last sample, the ``start`` of the next ones."""
    return np.asarray(_gear_dahl_state(at, values)[-1])


def _gear_dahl_at_state(torque: Array, at: At, values: Values) -> Array:
    return np.asarray(torque * values["efficiency"] ** -values["start"])


def _gear_dahl_rate(torque: Array, at: At, values: Values) -> Array:
    """(1 − s z) θ'/δ, θ the motor's angle winding in."""
    speed = np.gradient(at.wound_angle, at.time) * at.profile.gearbox.ratio
    return np.asarray(speed * (1.0 - np.sign(speed) * values["start"]) / values["distance"])


GEAR_DAHL = Effect(
    id="gear-dahl",
    stage=Stage.GEARBOX,
    parameters=(
        EFFICIENCY,
        sliding_distance("teeth"),
        START,
    ),
    apply=_gear_dahl,
    outputs=("motor_torque",),
    reduces_to=("gear-efficiency",),
    what="Teeth deform elastically before they slide, under friction in proportion to the load.",
    formula="τ η^(−z), dz/dθ = (1 − s z)/δ winding in, δ the distance; start: z at the start",
    source="Dahl 1968; efficiency as of the cable-winding device, Eq. 10",
    looks_like="The step of a gear's efficiency, which builds up over an angle after a reversal.",
    confused_with=("gear-efficiency", "motor-dahl", "torque-lag"),
    told_apart="Two loads; reversals at two speeds: a lag ends after a time.",
    family="gear friction",
    contains=("gear-efficiency",),
    needs=("cable_force", "gearing"),
    memory=True,
    carry=_gear_dahl_carry,
    dynamics=Dynamics(_gear_dahl_at_state, _gear_dahl_rate),
)
