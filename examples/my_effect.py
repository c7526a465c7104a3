"""A user effect: the drum is a pentagon.

Any command that compares a model with runs loads it by ``--effects examples/my_effect.py``. It is
then listed, has a card, and is a candidate of the diagnosis like every other effect.
"""

import numpy as np

from winchkit import Effect, Parameter
from winchkit.effects import Values
from winchkit.model.stages import At, Path, Stage

CORNERS = 5


def apply(path: Path, at: At, values: Values) -> Path:
    """Wound length (m) and torque arm (m) plus a sine of five periods per drum turn."""
    size, phase = values["amplitude"], values["phase"]
    angle = CORNERS * at.drum_angle - phase
    wave = size * (np.sin(angle) + np.sin(phase))
    return Path(path.value + wave, path.slope + CORNERS * size * np.cos(angle))


EFFECT = Effect(
    id="drum-corners",
    stage=Stage.WOUND,
    parameters=(
        Parameter("amplitude", "m", null=0.0, typical=2e-4, low=0.0, high=0.02),
        Parameter("phase", "rad", null=0.0, typical=1.0),
    ),
    apply=apply,
    outputs=("cable_length", "tension", "motor_torque"),
    what="The drum is built of five segments, and the cable bends over their edges.",
    formula="W + a (sin(5φ − p) + sin p)",
    source="first harmonic of a regular pentagon",
    looks_like="Five periods per drum turn, in length, torque and the load's acceleration.",
    confused_with=("gear-transmission-error", "motor-cogging"),
    told_apart="Two loads: the torque's ripple grows with the load; a ratio that is no multiple.",
    polar=("amplitude", "phase"),
)
