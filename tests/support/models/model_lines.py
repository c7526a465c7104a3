"""Lines and motions that the tests of the model share."""

from __future__ import annotations

from math import pi

import numpy as np

from winchkit.effects import Term, load_catalogue
from winchkit.model.line import Line
from winchkit.schema.profiles.winch import (
    CableSpec,
    DrumSpec,
    GearboxSpec,
    GuideSpec,
    PulleySpec,
    ReferenceSpec,
    WinchProfile,
)

CATALOGUE = load_catalogue()
DRUMS = {
    "spiral": DrumSpec("spiral", 0.06),
    "archimedean": DrumSpec("archimedean", 0.06, layer_growth=0.005),
    "grooved": DrumSpec("grooved", 0.06, groove_pitch=0.007),
    "squared": DrumSpec("squared", 0.06, build_up=2e-5),
}
KINEMATIC: dict[str, dict[str, float]] = {
    "drum-radius": {"radius_error": 1.5e-3},
    "gear-ratio": {"ratio_error": -0.03},
    "layer-thickness": {"thickness_error": 4e-4},
    "drum-eccentricity": {"eccentricity": 2e-3, "phase": 0.8},
    "gear-transmission-error": {"amplitude": 1e-3, "phase": 0.5, "order": 3.0},
    "guide-offset": {"offset": 0.05, "mismatch": 4e-3},
}


def profile_with(drum: str, direction: int = 1) -> WinchProfile:
    return WinchProfile(
        name="w",
        drum=DRUMS[drum],
        gearbox=GearboxSpec(ratio=17.3, direction=direction),  # type: ignore[arg-type]
        reference=ReferenceSpec(motor_angle=0.0, cable_length=8.0, wound_turns=3.2),
        cable=CableSpec(diameter=0.006, dead_length=1.0),
        guide=GuideSpec(screw_lead=0.006),
        pulley=(PulleySpec(0.04, pi / 2), PulleySpec(0.05, pi), PulleySpec(0.04, 0.3)),
    )


def line_with(profile: WinchProfile, effects: dict[str, dict[str, float]]) -> Line:
    terms = [Term(CATALOGUE[name], CATALOGUE[name].null | v) for name, v in effects.items()]
    return Line(profile, tuple(term.modifier() for term in terms))


def swing(amplitude: float = 60.0, rate: float = 0.4) -> tuple[np.ndarray, np.ndarray]:
    time = np.linspace(0, 20, 2001)
    return time, amplitude * np.sin(rate * time) ** 3
