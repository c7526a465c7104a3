"""cell-crosstalk: the load cell reads a share of the motor torque."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage


def apply(tension: Array, at: At, values: Values) -> Array:
    """Reading T + c m, m the measured motor torque."""
    return tension + values["share"] * at.motor_torque


EFFECT = Effect(
    id="cell-crosstalk",
    stage=Stage.CELL,
    parameters=(Parameter("share", "N/(N m)", null=0.0, typical=5.0, low=-1e5, high=1e5),),
    apply=apply,
    outputs=("tension",),
    variable="motor_torque",
    what="The motor current couples into the cell's cable, or the reaction torque into its mount.",
    formula="T + c m, m the measured motor torque",
    source="electromagnetic interference and side load of load cells, first order",
    looks_like="A tension error in proportion to the motor torque, its friction included.",
    confused_with=("cell-gain", "pulley-coulomb", "pulley-inertia"),
    told_apart="The same motion with the drive disabled, moved by hand, or two directions.",
    needs=("load", "torque"),
    order=4,
    left_out="it needs the measured torque; shield the cell's cable",
)
