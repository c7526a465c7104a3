"""motor-dahl: friction of the motor side that builds up after a reversal (presliding)."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.friction import dahl
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque plus Dahl friction over the motor angle."""
    limit = values["torque"]
    if limit == 0.0:
        return torque
    stiffness = limit / values["distance"]
    return torque + dahl(
        at.motor_angle, np.full_like(torque, limit), stiffness, 1.0, values["start"]
    )


def carried(after: Array, before: Array, at: At, values: Values) -> float:
    """F/c at the last sample."""
    limit = values["torque"]
    return float((after[-1] - before[-1]) / limit) if limit else 0.0


EFFECT = Effect(
    id="motor-dahl",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("torque", "N m", null=0.0, typical=0.02, low=0.0, high=1e6),
        Parameter(
            "distance",
            "rad",
            null=0.1,
            typical=0.1,
            low=1e-6,
            high=1e3,
            role="shape",
            grid=(0.001, 0.004, 0.016, 0.064),
            along="motor_angle",
            plausible=Plausible(0.0, 6.3, "teeth, seals and bearings slide within a motor turn"),
        ),
        Parameter("start", "1", null=0.0, typical=0.5, low=-1.0, high=1.0, role="fixed"),
    ),
    apply=apply,
    outputs=("motor_torque",),
    what="Teeth, seals and bearings deform elastically before they slide.",
    formula="τ + F, dF/dθ = (c − s F)/δ, δ the distance; start: F/c at the start",
    source="Dahl 1968; presliding of a joint (Armstrong-Hélouvry et al. 1994)",
    looks_like="A torque error of Coulomb friction that builds up over an angle after a reversal.",
    confused_with=("motor-coulomb", "motor-stribeck", "torque-lag"),
    told_apart="Reversals at two speeds: presliding ends after an angle, a lag after a time.",
    family="motor friction",
    contains=("motor-coulomb",),
    memory=True,
    carry=carried,
)
