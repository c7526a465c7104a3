"""gear-dahl: friction of the teeth in proportion to the load that builds up after a reversal."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Dynamics, Effect, Parameter, Plausible, Values
from winchkit.effects.on_torque.gear_efficiency import EFFICIENCY
from winchkit.effects.presliding import START
from winchkit.model.friction import dahl
from winchkit.model.stages import At, Stage


def _state(at: At, values: Values) -> Array:
    """State z, from −1 paying out to 1 winding in."""
    wound_in = at.wound_angle * at.profile.gearbox.ratio
    return dahl(wound_in, np.ones(len(wound_in)), 1 / values["distance"], start=values["start"])


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque τ η^(−z)."""
    return np.asarray(torque * values["efficiency"] ** -_state(at, values))


def carry(after: Array, before: Array, at: At, values: Values) -> Array:
    """State z at the last sample, the ``start`` of the next ones."""
    return np.asarray(_state(at, values)[-1])


def _at_state(torque: Array, at: At, values: Values) -> Array:
    return np.asarray(torque * values["efficiency"] ** -values["start"])


def _rate(torque: Array, at: At, values: Values) -> Array:
    """(1 − s z) θ'/δ, θ the motor's angle winding in."""
    speed = np.gradient(at.wound_angle, at.time) * at.profile.gearbox.ratio
    return np.asarray(speed * (1.0 - np.sign(speed) * values["start"]) / values["distance"])


EFFECT = Effect(
    id="gear-dahl",
    stage=Stage.GEARBOX,
    parameters=(
        EFFICIENCY,
        Parameter(
            "distance",
            "rad",
            null=0.1,
            typical=0.1,
            low=1e-6,
            high=6.3,
            role="shape",
            grid=(0.001, 0.004, 0.016, 0.064),
            along="motor_angle",
            plausible=Plausible(0.0, 6.3, "teeth slide within a motor turn"),
        ),
        START,
    ),
    apply=apply,
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
    carry=carry,
    dynamics=Dynamics(_at_state, _rate),
)
