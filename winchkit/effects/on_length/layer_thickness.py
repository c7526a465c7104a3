"""layer-thickness: the growth of the radius per layer differs from the profile."""

from dataclasses import replace

from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.drum import Archimedean, Drum, Spiral
from winchkit.model.stages import At, Stage


def apply(drum: Drum, at: At, values: Values) -> Drum:
    """A layered drum with growth g + δ; other drums have no layers and are unchanged."""
    if isinstance(drum, Spiral | Archimedean):
        return replace(drum, growth=drum.growth + values["thickness_error"])
    return drum


EFFECT = Effect(
    id="layer-thickness",
    stage=Stage.DRUM,
    parameters=(
        Parameter(
            "thickness_error",
            "m",
            null=0.0,
            typical=1e-4,
            low=-0.005,
            high=0.005,
            plausible=Plausible(
                -1.0, 1.0, "a layer is between nothing and two cables thick", of="cable.diameter"
            ),
        ),
    ),
    apply=apply,
    outputs=("cable_length", "motor_torque"),
    variable="cable_length",
    what="The layer growth differs from the profile: the cable flattens or nests.",
    formula="W(Φ; g + δ)",
    source="CABTIVE paper, Eq. 2 with d_c as a parameter (Table 4: 0.42 to 0.54 mm)",
    looks_like="A parabola of the length error over the drum angle; torque follows the radius.",
    confused_with=("guide-offset", "drum-radius"),
    told_apart="A constant weight over the whole stroke: layers change the torque, a guide hardly.",
    needs=("layers",),
    on_robot=frozenset({"all"}),
)
