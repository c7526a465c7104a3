"""pulley-viscous: friction of the pulleys in proportion to the speed."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage


def apply(tension: Array, at: At, values: Values) -> Array:
    """Tension plus c v."""
    return tension + values["viscosity"] * at.speed


EFFECT = Effect(
    id="pulley-viscous",
    stage=Stage.PULLEY,
    parameters=(Parameter("viscosity", "N s/m", null=0.0, typical=10.0, low=0.0, high=1e6),),
    apply=apply,
    outputs=("tension", "motor_torque"),
    variable="speed",
    what="Grease and seals of every pulley have friction in proportion to the cable speed.",
    formula="T1 = T0 + c v",
    source="viscous friction",
    looks_like="A tension error that is odd and linear in the speed, at any load.",
    confused_with=("pulley-coulomb", "pulley-stribeck"),
    told_apart="A ladder of speeds in both directions.",
    needs=("pulley", "load"),
    order=1,
)
