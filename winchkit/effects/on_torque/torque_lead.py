"""torque-lead: the torque on record is what the drive was told, before the motor has it."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.derivatives import shifted
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque as it will be when the drive has followed."""
    return shifted(torque, at.time, values["lead"])


EFFECT = Effect(
    id="torque-lead",
    stage=Stage.TORQUE_SIGNAL,
    parameters=(Parameter("lead", "s", null=0.0, typical=5e-3, low=0.0, high=2.0),),
    apply=apply,
    outputs=("motor_torque",),
    what="The record has the torque that the drive was told (0x6074), not the one that it gives "
    "(0x6077): its loops and its bus follow later.",
    formula="m(t) = τ(t + δ)",
    source="definition of a delay; seen on EMPS (Janot et al. 2019), where the record is the "
    "command",
    looks_like="A torque error in proportion to how fast the torque changes, ahead of it.",
    confused_with=("torque-lag", "rotor-inertia"),
    told_apart="Fast moves under two loads, with the drive's actual torque beside the one it is "
    "told.",
)
