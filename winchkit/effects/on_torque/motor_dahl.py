"""motor-dahl: friction of the motor side that builds up after a reversal (presliding)."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.effects.presliding import START, Presliding
from winchkit.model.stages import At, Stage


def _limit(torque: Array, at: At, values: Values) -> Array:
    """F_c = c at every sample, N m."""
    return np.full_like(torque, values["torque"])


def _motor_angle(at: At) -> Array:
    return at.motor_angle


def _stiffness(values: Values) -> float:
    """σ = c/δ, N m/rad."""
    return values["torque"] / values["distance"]


FRICTION = Presliding("torque", _limit, _motor_angle, _stiffness)

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
            high=6.3,
            role="shape",
            grid=(0.001, 0.004, 0.016, 0.064),
            along="motor_angle",
            plausible=Plausible(0.0, 6.3, "teeth, seals and bearings slide within a motor turn"),
        ),
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
