"""torque-constant: the drive's torque scale is wrong."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque (1 + g) τ."""
    return torque * (1.0 + values["gain_error"])


EFFECT = Effect(
    id="torque-constant",
    stage=Stage.TORQUE_CONSTANT,
    parameters=(
        Parameter(
            "gain_error",
            "1",
            null=0.0,
            typical=0.03,
            low=-0.9,
            high=10.0,
            plausible=Plausible(
                -0.5, 0.5, "temperature, tolerance, and peak for rms values (√2) are within ±50 %"
            ),
        ),
    ),
    apply=apply,
    outputs=("motor_torque",),
    variable="load",
    what="The drive's torque constant or rated torque is wrong, or the magnets are warm.",
    formula="(1 + g) τ",
    source="motor data sheets give ±10 %",
    looks_like="A torque error in proportion to the load, equal in both directions.",
    confused_with=("gear-efficiency", "cell-gain", "drum-radius"),
    told_apart="Several loads in both directions; the length excludes a wrong drum radius.",
    needs=("cable_force",),
)
