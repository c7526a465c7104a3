"""pulley-capstan: the cable slides around a pulley that does not turn."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.effects.transition import CABLE_TRANSITION, cable_direction
from winchkit.model.friction import capstan_ratio
from winchkit.model.stages import At, Stage


def apply(tension: Array, at: At, values: Values) -> Array:
    """Tension after a wrap with Euler-Eytelwein friction."""
    return tension * capstan_ratio(cable_direction(at, values) * values["friction"], at.wrap)


EFFECT = Effect(
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
    apply=apply,
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
