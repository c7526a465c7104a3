"""gear-efficiency: the gearbox loses a share of the power."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.effects.transition import CABLE_TRANSITION, cable_direction
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Torque τ η^(−s): more winding in, less paying out."""
    return torque * values["efficiency"] ** -cable_direction(at, values)


EFFICIENCY = Parameter(
    "efficiency",
    "1",
    null=1.0,
    typical=0.9,
    low=0.05,
    high=1.0,
    plausible=Plausible(0.2, 1.0, "a worm gear has 0.3"),
)
"""Output power over input power of a gear."""
EFFECT = Effect(
    id="gear-efficiency",
    stage=Stage.GEARBOX,
    parameters=(
        EFFICIENCY,
        CABLE_TRANSITION,
    ),
    apply=apply,
    outputs=("motor_torque",),
    variable="direction",
    what="Tooth friction in proportion to the load: more motor torque winding in, less paying out.",
    formula="τ/η winding in, τ η paying out, smooth between",
    source="Cable-winding device, Eq. 10: 0.68 over six bearings and a belt",
    looks_like="A step of the torque error with the direction, in proportion to the load.",
    confused_with=("torque-constant", "motor-coulomb", "pulley-coulomb", "gear-dahl"),
    told_apart="Two loads in both directions.",
    family="gear friction",
    needs=("cable_force", "gearing"),
)
