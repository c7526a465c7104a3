"""motor-coulomb: Coulomb friction of the motor side."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.effects.transition import MOTOR_TRANSITION, motor_direction
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque plus s c."""
    return torque + values["torque"] * motor_direction(at, values)


EFFECT = Effect(
    id="motor-coulomb",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("torque", "N m", null=0.0, typical=0.02, low=0.0, high=1e6),
        MOTOR_TRANSITION,
    ),
    apply=apply,
    outputs=("motor_torque",),
    variable="direction",
    what="Coulomb friction of bearings, seals and gears, independent of the load.",
    formula="τ + s c",
    source="Coulomb friction",
    looks_like="A step of the torque error with the direction, the same at every load.",
    confused_with=("gear-efficiency", "motor-stribeck", "motor-viscous", "motor-dahl"),
    told_apart="Two loads in both directions; a ladder of speeds.",
    family="motor friction",
)
