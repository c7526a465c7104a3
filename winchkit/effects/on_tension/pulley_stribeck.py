"""pulley-stribeck: higher friction of a pulley at low speed."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.effects.transition import CABLE_TRANSITION, cable_direction
from winchkit.model.friction import coulomb_ratio, stribeck
from winchkit.model.stages import At, Stage


def apply(tension: Array, at: At, values: Values) -> Array:
    """Tension after a pulley whose friction falls from μs to μc with the speed."""
    friction = stribeck(at.speed, values["coulomb"], values["static"], values["stribeck_speed"])
    return tension * coulomb_ratio(cable_direction(at, values) * friction, at.wrap)


def _sticks(values: Values) -> bool:
    """Whether friction at standstill is at least that in motion, as with a film of grease."""
    return values["static"] >= values["coulomb"]


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
        CABLE_TRANSITION,
    ),
    apply=apply,
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
