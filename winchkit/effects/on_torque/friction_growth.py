"""friction-growth: Coulomb friction that changes with time."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.effects.transition import MOTOR_TRANSITION, motor_direction
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque plus s g t, t from the run's start."""
    return torque + values["rate"] * at.time * motor_direction(at, values)


EFFECT = Effect(
    id="friction-growth",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("rate", "N m/s", null=0.0, typical=2e-4, low=-1e3, high=1e3),
        MOTOR_TRANSITION,
    ),
    apply=apply,
    outputs=("motor_torque",),
    what="Coulomb friction changes within a run: grease warms up, a seal or a brake wears.",
    formula="τ + s g t, t from the run's start",
    source="Coulomb friction with a linear trend",
    looks_like="A step of the torque error with the direction that grows with time.",
    confused_with=("motor-coulomb", "motor-viscous"),
    told_apart="A long run at one speed and load, and a repeat after a pause.",
    family="motor friction",
)
