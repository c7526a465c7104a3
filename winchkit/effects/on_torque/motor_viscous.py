"""motor-viscous: friction of the motor side in proportion to its speed."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque plus b θ'."""
    return torque + values["viscosity"] * at.motor_rate


EFFECT = Effect(
    id="motor-viscous",
    stage=Stage.MOTOR,
    parameters=(Parameter("viscosity", "N m s", null=0.0, typical=1e-3, low=0.0, high=1e6),),
    apply=apply,
    outputs=("motor_torque",),
    variable="speed",
    what="Losses by grease, eddy currents and windage in proportion to the speed.",
    formula="τ + b θ'",
    source="viscous friction",
    looks_like="A torque error that is odd and linear in the motor's speed.",
    confused_with=("motor-coulomb", "pulley-viscous"),
    told_apart="A ladder of speeds in both directions.",
    family="motor friction",
)
