"""drum-eccentricity: runout of the drum, one period per turn."""

import numpy as np

from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.stages import At, Path, Stage


def apply(path: Path, at: At, values: Values) -> Path:
    """Wound length plus e (sin(φ − φ0) + sin φ0), and its derivative."""
    size, phase = values["eccentricity"], values["phase"]
    turned = at.drum_angle - phase
    return Path(
        path.value + size * (np.sin(turned) + np.sin(phase)), path.slope + size * np.cos(turned)
    )


EFFECT = Effect(
    id="drum-eccentricity",
    stage=Stage.WOUND,
    parameters=(
        Parameter(
            "eccentricity",
            "m",
            null=0.0,
            typical=2e-4,
            low=0.0,
            high=0.02,
            plausible=Plausible(
                0.0,
                0.1,
                "a drum that runs out by a tenth of its radius is bent",
                of="drum.winding_radius",
            ),
        ),
        Parameter("phase", "rad", null=0.0, typical=1.0),
    ),
    apply=apply,
    outputs=("cable_length", "motor_torque"),
    variable="drum_angle",
    what="The drum's axis is not the axis of its surface.",
    formula="W + e (sin(φ − φ0) + sin φ0)",
    source="geometry of an eccentric circle, first order in e",
    looks_like="A sine once per drum turn in length, and in torque in proportion to the load.",
    confused_with=("gear-transmission-error",),
    told_apart="Two loads: the torque's sine grows with the load. A ratio that is not whole.",
    polar=("eccentricity", "phase"),
    on_robot=frozenset({"one"}),
)
