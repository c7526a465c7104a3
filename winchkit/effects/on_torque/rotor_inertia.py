"""rotor-inertia: inertia of the rotor."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque plus J θ''."""
    return torque + values["inertia"] * at.motor_acceleration


EFFECT = Effect(
    id="rotor-inertia",
    stage=Stage.MOTOR,
    parameters=(
        Parameter(
            "inertia",
            "kg m^2",
            null=0.0,
            typical=1e-4,
            low=0.0,
            plausible=Plausible(
                0.0, 1.0, "rotors of motors up to 100 kW are below 1 kg m²", of_winch=True
            ),
        ),
    ),
    apply=apply,
    outputs=("motor_torque",),
    variable="acceleration",
    what="Inertia of rotor, brake, coupling and gearbox input; of an axis, with what it moves.",
    formula="τ + J θ''",
    source="Newton",
    looks_like="Torque in proportion to the motor's acceleration, at any load.",
    confused_with=("torque-lag", "pulley-inertia"),
    told_apart="Fast and slow moves without load.",
)
