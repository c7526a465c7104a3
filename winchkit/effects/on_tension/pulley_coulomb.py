"""pulley-coulomb: Coulomb friction of each pulley's bearing."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.effects.transition import CABLE_TRANSITION, cable_direction
from winchkit.model.friction import coulomb_ratio
from winchkit.model.stages import At, Stage


def apply(tension: Array, at: At, values: Values) -> Array:
    """Tension after a pulley with friction μ N against the cable's motion."""
    return tension * coulomb_ratio(cable_direction(at, values) * values["friction"], at.wrap)


EFFECT = Effect(
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
    apply=apply,
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
