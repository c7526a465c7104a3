"""pulley-dahl: pulley friction that builds up with distance after a reversal (presliding)."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.effects.presliding import START, Presliding
from winchkit.model.friction import coulomb_ratio
from winchkit.model.stages import At, Stage


def _limit(tension: Array, at: At, values: Values) -> Array:
    """F_c = μ N, the Coulomb friction of this pulley, N."""
    return np.abs(tension) * (coulomb_ratio(values["friction"], at.wrap) - 1.0)


def _wound_in(at: At) -> Array:
    return -at.free_length


def _stiffness(values: Values) -> float:
    return values["stiffness"]


FRICTION = Presliding("friction", _limit, _wound_in, _stiffness)

EFFECT = Effect(
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
