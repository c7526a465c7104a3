"""Lines and motions that the tests of effects share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from winchkit.effects import Effect, Term, load_catalogue
from winchkit.effects.reference_motion import STANDARD_PROFILE, standard_motion
from winchkit.model.line import Line, Motion
from winchkit.model.stages import Signals
from winchkit.schema.profiles.winch import DrumSpec, WinchProfile

CATALOGUE = load_catalogue()
EFFECTS = [effect for effect in CATALOGUE if not effect.of_robots]
IDS = [effect.id for effect in EFFECTS]
ROBOT_EFFECTS = [effect for effect in CATALOGUE if effect.of_robots and effect.on_robot]
ALL_IDS = [effect.id for effect in CATALOGUE]

DRUMS = {
    "spiral": DrumSpec("spiral", 0.06),
    "archimedean": DrumSpec("archimedean", 0.06, layer_growth=0.005),
    "grooved": DrumSpec("grooved", 0.06, groove_pitch=0.007),
    "squared": DrumSpec("squared", 0.06, build_up=2e-5),
}

MINE = """
from winchkit.effects.effect import Effect, Parameter
from winchkit.model.stages import Stage

def apply(length, at, values):
    return length + values["size"]

MINE = Effect(
    id="my-own", stage=Stage.FRAME, parameters=(Parameter("size", "m", null=0.0, typical=1e-3),),
    apply=apply, outputs=("cable_length",), what="Mine.", formula="l + a", source="me",
    looks_like="A constant.", told_apart="Ask me.",
)
"""
"""A user's own file of effects."""


def profile_with(drum: str) -> WinchProfile:
    return replace(STANDARD_PROFILE, drum=DRUMS[drum])


def standard_on(drum: str, **changed: object) -> tuple[Line, Motion]:
    """The standard motion's signals on another drum, some of them changed."""
    at = standard_motion().at
    signals = Signals(
        at.time,
        at.motor_angle,
        load=standard_motion().load,
        payload=at.payload,
        temperature=at.temperature,
        motor_torque=at.motor_torque,
    )
    line = Line(profile_with(drum))
    return line, line.motion(replace(signals, **changed))


def predict(
    profile: WinchProfile, motion: Motion, effect: Effect, values: dict[str, float]
) -> dict[str, np.ndarray]:
    term = Term(effect, effect.null | values)
    return Line(profile, (term.modifier(),)).predict(motion)
