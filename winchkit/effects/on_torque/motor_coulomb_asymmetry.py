"""motor-coulomb-asymmetry: friction differs between the two directions."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque plus an offset."""
    return torque + values["offset"]


EFFECT = Effect(
    id="motor-coulomb-asymmetry",
    stage=Stage.MOTOR,
    parameters=(Parameter("offset", "N m", null=0.0, typical=0.01, low=-1e6, high=1e6),),
    apply=apply,
    outputs=("motor_torque",),
    what="Coulomb friction depends on the direction, or the torque signal has an offset.",
    formula="τ + o, o = (c₊ − c₋)/2",
    source="Coulomb friction, one value per direction",
    looks_like="A constant torque error.",
    confused_with=("torque-constant", "motor-coulomb"),
    told_apart="Two loads: a wrong torque constant grows with them.",
    family="motor friction",
)
