"""spring-balancer: a spring between the moving part and the frame."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque plus k φ + c, φ the drum angle since the reference."""
    return torque + (values["stiffness"] * at.drum_angle + values["torque"])


EFFECT = Effect(
    id="spring-balancer",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("stiffness", "N m/rad", null=0.0, typical=1e-3, low=-1e6, high=1e6),
        Parameter("torque", "N m", null=0.0, typical=0.01, low=-1e6, high=1e6),
    ),
    apply=apply,
    outputs=("motor_torque",),
    part="load",
    variable="drum_angle",
    reduces_to=("motor-coulomb-asymmetry",),
    what="A spring, or a counterweight with a chain, acts on the moving part.",
    formula="τ + k φ + c, φ the drum angle since the reference",
    source="Hooke's law; weight balancing of arms and doors by springs",
    looks_like="A torque error that is a straight line over the position, at every load.",
    confused_with=("cable-weight", "joint-gravity", "motor-coulomb-asymmetry"),
    told_apart="The tension: the weight of the cable is in it, a spring at the drum is not.",
    family="motor friction",
    contains=("motor-coulomb-asymmetry",),
    order=-2,
)
