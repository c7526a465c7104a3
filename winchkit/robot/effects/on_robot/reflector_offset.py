"""reflector-offset: the observed point of the platform is not the one of the profile."""

from dataclasses import replace

import numpy as np

from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage
from winchkit.robot.geometry.tracker import Tracker


def apply(tracker: Tracker, at: At, values: Values) -> Tracker:
    """A tracker that observes another point of the platform."""
    by = np.array([values["x"], values["y"], values["z"]])
    return replace(tracker, offset=tracker.offset + by)


EFFECT = Effect(
    id="reflector-offset",
    stage=Stage.TRACKER,
    parameters=tuple(
        Parameter(axis, "m", null=0.0, typical=3e-3, low=-2.0, high=2.0) for axis in "xyz"
    ),
    apply=apply,
    outputs=("cable_length",),
    variable="pose",
    what="The reflector or the marker set is not where the profile has it on the platform.",
    formula="y = c + R (o + δo)",
    source="Calibration of robots with laser trackers; M. Gouttefarde et al.",
    looks_like="Position errors that are constant in the platform's frame.",
    confused_with=("anchor-point", "tracker-frame", "home-length"),
    told_apart="Poses with large rotations: the offset turns with the platform, a frame does not.",
    needs=("robot",),
    on_robot=frozenset({"platform"}),
)
