"""torque-lead: the recorded torque is the commanded one, ahead of the motor's torque."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.derivatives import shifted
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque after the delay of the drive."""
    return shifted(torque, at.time, values["lead"])


def undo(reported: Array, time: Array, values: Values) -> Array:
    """The motor's torque follows the command."""
    return shifted(reported, time, -values["lead"])


EFFECT = Effect(
    id="torque-lead",
    stage=Stage.TORQUE_SIGNAL,
    parameters=(
        Parameter(
            "lead",
            "s",
            null=0.0,
            typical=5e-3,
            low=0.0,
            high=2.0,
            plausible=Plausible(0.0, 0.2, "a drive follows its command within a tenth of a second"),
        ),
    ),
    apply=apply,
    undo=undo,
    outputs=("motor_torque",),
    what="The record has the commanded torque (0x6074), not the actual one (0x6077), which follows "
    "with the delay of bus and control loop.",
    formula="m(t) = τ(t + δ)",
    source="definition of a delay; observed on EMPS (Janot et al. 2019), where the record is the "
    "command",
    looks_like="A torque error in proportion to the rate of the torque, ahead of it.",
    confused_with=("torque-lag", "rotor-inertia"),
    told_apart="Fast moves under two loads, with the drive's actual and commanded torque.",
)
