"""pulley-stribeck: a pulley holds harder at creep speed than when it runs."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.friction import coulomb_ratio, has_fallen, stribeck
from winchkit.model.stages import At, Stage


def apply(tension: Array, at: At, values: Values) -> Array:
    """Tension after a pulley whose friction falls from μs to μc with the speed."""
    friction = stribeck(at.speed, values["coulomb"], values["static"], values["stribeck_speed"])
    return tension * coulomb_ratio(at.direction * friction, at.wrap)


def _sticks(values: Values) -> bool:
    """Friction falls as a film of grease builds up: it is no less at creep speed."""
    return values["static"] >= values["coulomb"]


def _passed(at: At, values: Values) -> bool:
    """Whether the extra that is there at creep speed ever falls."""
    return has_fallen(at.speed, values["stribeck_speed"])


EFFECT = Effect(
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
    ),
    apply=apply,
    outputs=("tension", "motor_torque"),
    what="Bearings rub more at creep speed, before a film of grease carries.",
    formula="T1 = T0 + s N (μc + (μs − μc) exp(−(v/vs)²))",
    source="Stribeck curve (Armstrong-Hélouvry et al. 1994) with Eq. 22 for N",
    looks_like="Friction with an extra at creep speed, in proportion to the tension.",
    confused_with=("pulley-dahl", "pulley-coulomb"),
    told_apart="Very slow ramps, at several speeds from 1 to 100 mm/s.",
    family="pulley friction",
    contains=("pulley-coulomb", "pulley-capstan"),
    needs=("pulley", "load"),
    possible=_sticks,
    visible=_passed,
)
