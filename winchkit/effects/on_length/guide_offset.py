"""guide-offset: axial offset of the cable guide from the point where the cable winds."""

import numpy as np

from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Path, Stage

_TURN = 2 * np.pi


def apply(path: Path, at: At, values: Values) -> Path:
    """Wound length plus the detour by the guide √(h² + x²) − h, x = x0 + m Φ/2π."""
    guide = at.profile.guide
    if guide is None:
        return path
    per_radian = values["mismatch"] / _TURN
    aside = values["offset"] + per_radian * at.wound_angle
    reach = np.hypot(guide.distance, aside)
    return Path(path.value + (reach - guide.distance), path.slope + per_radian * aside / reach)


EFFECT = Effect(
    id="guide-offset",
    stage=Stage.WOUND,
    parameters=(
        Parameter("offset", "m", null=0.0, typical=0.01, low=-0.3, high=0.3),
        Parameter("mismatch", "m", null=0.0, typical=1e-3, low=-0.02, high=0.02),
    ),
    apply=apply,
    outputs=("cable_length", "motor_torque"),
    part="guide",
    variable="cable_length",
    what="The guide is mounted with an offset, or its lead differs from the groove pitch.",
    formula="ℓ − (√(h² + (x0 + m Φ/2π)²) − h), h = guide.distance, m per turn",
    source="Pythagoras; cable-winding device, section on the guide",
    looks_like="A parabola of the length error over the travel of the guide.",
    confused_with=("layer-thickness", "drum-radius", "gear-ratio"),
    told_apart="Shift the guide by a known amount; or the torque at constant weight.",
    needs=("guide",),
    order=1,
    probes=(
        {"mismatch": 1e-3},
        {"offset": 0.01, "mismatch": 1e-3},
        {"offset": -0.02, "mismatch": 1e-3},
        {"offset": 0.1, "mismatch": 1e-3},
    ),
    on_robot=frozenset({"one"}),
)
