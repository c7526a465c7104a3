"""pulley-dahl: pulley friction that builds up with distance after a reversal (presliding)."""

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.friction import coulomb_ratio, dahl
from winchkit.model.stages import At, Stage


def apply(tension: Array, at: At, values: Values) -> Array:
    """Tension after a pulley with Dahl friction whose limit is the Coulomb friction there."""
    friction = values["friction"]
    if friction == 0.0:
        return tension
    limit = _limit(tension, friction, at)
    wound_in = -at.free_length
    return tension + dahl(wound_in, limit, values["stiffness"], values["shape"], values["start"])


def _limit(tension: Array, friction: float, at: At) -> Array:
    """F_c = μ N on this pulley, N."""
    return np.abs(tension) * (float(coulomb_ratio(np.asarray(friction), at.wrap)) - 1.0)


def carried(after: Array, before: Array, at: At, values: Values) -> float:
    """F/F_c at the last sample."""
    limit = float(_limit(before[-1:], values["friction"], at)[0])
    return float((after[-1] - before[-1]) / limit) if limit else 0.0


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
        Parameter("start", "1", null=0.0, typical=0.5, low=-1.0, high=1.0, role="fixed"),
    ),
    apply=apply,
    outputs=("tension", "motor_torque"),
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
    carry=carried,
)
