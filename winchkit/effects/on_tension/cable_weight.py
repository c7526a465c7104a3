"""cable-weight: weight of the free cable."""

from math import sin

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.stages import At, Stage
from winchkit.units import GRAVITY


def apply(tension: Array, at: At, values: Values) -> Array:
    """Tension plus the weight of the free cable along its direction."""
    along = GRAVITY * sin(at.profile.path.inclination)
    return tension + values["mass_per_length"] * along * at.free_length


EFFECT = Effect(
    id="cable-weight",
    stage=Stage.CABLE_WEIGHT,
    parameters=(
        Parameter(
            "mass_per_length",
            "kg/m",
            null=0.0,
            typical=0.14,
            low=0.0,
            high=50.0,
            plausible=Plausible(0.0, 20.0, "a steel cable of 70 mm has 20 kg/m"),
        ),
    ),
    apply=apply,
    outputs=("tension", "motor_torque"),
    variable="cable_length",
    what="The weight of the free cable adds to the tension towards the winch.",
    formula="T + m g ℓ sin(inclination)",
    source="statics; 6 mm steel cable 0.14 kg/m",
    looks_like="A tension error in proportion to the free length, at any load.",
    confused_with=("cell-offset", "cell-drift"),
    told_apart="The full stroke, up and down.",
    needs=("load",),
)
