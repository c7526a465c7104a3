"""encoder-slip: a single slip of the encoder's coupling, a lasting error of the drum angle."""

import numpy as np

from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Path, Stage

_DURATION = 0.4
"""s: several samples at 50 Hz, so that a fit's derivative by the time of the slip exists; short
against a stroke."""


def apply(path: Path, at: At, values: Values) -> Path:
    """Drum angle with a smooth step that begins at t0 and takes 0.4 s."""
    x = np.clip((at.time - values["time"]) / _DURATION, 0.0, 1.0)
    return Path(path.value + values["step"] * (x * x * (3 - 2 * x)), path.slope)


EFFECT = Effect(
    id="encoder-slip",
    stage=Stage.DRUM_ANGLE,
    parameters=(
        Parameter("step", "rad", null=0.0, typical=0.02, low=-7.0, high=7.0),
        Parameter(
            "time",
            "s",
            null=60.0,
            typical=90.0,
            low=0.0,
            high=86400.0,
            role="shape",
            grid=(2, 6, 12, 20, 30, 45, 60, 80, 100, 125, 150, 180),
            onset=_DURATION,
        ),
    ),
    apply=apply,
    outputs=("cable_length", "motor_torque"),
    part="encoder",
    variable="time",
    what="A coupling or a belt slipped: from then on the encoder has an error.",
    formula="φ + Δφ x²(3 − 2x), x = (t − t0) / 0.4 s from 0 to 1, t from the run's start",
    source="field experience; a smooth step, so that a fit can find its time",
    looks_like="A step of the length at one moment that does not return.",
    confused_with=("cable-creep", "gear-backlash"),
    told_apart="Return to the same place at the end of the run: creep recovers, a slip stays.",
    order=3,
    left_out="it occurred once, in the run that showed it; repeat the homing (winchkit home)",
)
