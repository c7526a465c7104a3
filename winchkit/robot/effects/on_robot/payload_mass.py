"""payload-mass: the platform's mass differs from the profile."""

from dataclasses import replace

from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage
from winchkit.schema.profiles.robot import PlatformSpec


def apply(platform: PlatformSpec, at: At, values: Values) -> PlatformSpec:
    """A platform of mass m + δm."""
    return replace(platform, mass=platform.mass + values["mass_error"])


EFFECT = Effect(
    id="payload-mass",
    stage=Stage.PAYLOAD,
    parameters=(Parameter("mass_error", "kg", null=0.0, typical=0.3, low=-1e4, high=1e4),),
    apply=apply,
    outputs=("tension",),
    variable="pose",
    what="The mass of the platform differs from the profile: a tool, a payload, a hose.",
    formula="Δt = A⁺ᵀ Δw, Δw = −(δm g, c × δm g)",
    source="Static balance A t + w = 0; IPAnema 3 paper, Eq. 7 and 8 with the sign corrected",
    looks_like="Tensions above those that balance the weight in upper lines, below in lower lines.",
    confused_with=("payload-centre", "cell-gain"),
    told_apart="A weight known well on the platform: it changes the mass, and no cell.",
    needs=("robot", "cable_force"),
    on_robot=frozenset({"platform"}),
)
