"""drum-radius: the winding radius differs from the profile."""

from dataclasses import replace

from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.drum import Archimedean, Grooved, Spiral, Squared
from winchkit.model.stages import At, Stage

LayeredDrum = Archimedean | Grooved | Spiral | Squared


def apply(drum: LayeredDrum, at: At, values: Values) -> LayeredDrum:
    """A drum whose first layer lies at radius r + δr."""
    return replace(drum, winding_radius=drum.winding_radius + values["radius_error"])


EFFECT = Effect(
    id="drum-radius",
    stage=Stage.DRUM,
    parameters=(
        Parameter(
            "radius_error",
            "m",
            null=0.0,
            typical=5e-4,
            low=-0.02,
            high=0.02,
            plausible=Plausible(
                -0.2,
                0.2,
                "wear, machining and a compressed cable are per cent of the radius",
                of="drum.winding_radius",
            ),
        ),
    ),
    apply=apply,
    outputs=("cable_length", "motor_torque"),
    variable="cable_length",
    what="The winding radius differs from the profile: machining, cable compression, a wrong r.",
    formula="W(Φ; r + δr)",
    source="CABTIVE paper, Eq. 2 with r_w as a parameter (Table 7: 59 to 60.5 for 60 mm)",
    looks_like="A length error in proportion to the drum angle, at any tension.",
    confused_with=("gear-ratio", "layer-thickness"),
    told_apart="An encoder on the drum; on a layered drum a stroke over several layers.",
    on_robot=frozenset({"one", "all"}),
)
