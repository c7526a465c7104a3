"""payload-centre: the platform's centre of mass differs from the profile."""

from dataclasses import replace

from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage
from winchkit.schema.profiles.robot import PlatformSpec


def apply(platform: PlatformSpec, at: At, values: Values) -> PlatformSpec:
    """A platform whose centre of mass is shifted."""
    x, y, z = platform.center_of_mass
    centre = (x + values["x"], y + values["y"], z + values["z"])
    return replace(platform, center_of_mass=centre)


EFFECT = Effect(
    id="payload-centre",
    stage=Stage.PAYLOAD,
    parameters=tuple(
        Parameter(axis, "m", null=0.0, typical=0.01, low=-5.0, high=5.0) for axis in "xyz"
    ),
    apply=apply,
    outputs=("tension",),
    variable="pose",
    what="The platform's centre of mass differs from the profile.",
    formula="Δt = A⁺ᵀ Δw, Δw = −(0, R δc × m g)",
    source="Static balance A t + w = 0; IPAnema 3 paper, Eq. 7 and 8 with the sign corrected",
    looks_like="Higher tensions on one side and lower ones on the other, by a constant moment.",
    confused_with=("payload-mass", "cell-gain"),
    told_apart="Poses that turn the platform: its height matters only where the platform tilts.",
    needs=("robot", "cable_force"),
    on_robot=frozenset({"platform"}),
)
