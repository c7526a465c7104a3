"""tracker-frame: the tracker stands in another frame than the profile has."""

from dataclasses import replace

import numpy as np

from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.rotation import rotation_by, rotation_vector
from winchkit.model.stages import At, Stage
from winchkit.robot.geometry.tracker import Tracker


def apply(tracker: Tracker, at: At, values: Values) -> Tracker:
    """A tracker whose readings are shifted, and turned about the robot's home position."""
    shift = np.array([values["x"], values["y"], values["z"]])
    turn = np.array([values["rx"], values["ry"], values["rz"]])
    if not np.any(turn):
        return replace(tracker, shift=tracker.shift + shift)
    turned = rotation_by(turn)
    return replace(
        tracker,
        shift=shift + turned @ tracker.shift,
        turn=rotation_vector(turned @ rotation_by(tracker.turn)),
    )


EFFECT = Effect(
    id="tracker-frame",
    stage=Stage.TRACKER,
    parameters=(
        *(Parameter(axis, "m", null=0.0, typical=1e-3, low=-20.0, high=20.0) for axis in "xyz"),
        *(
            Parameter(axis, "rad", null=0.0, typical=1e-3, low=-3.2, high=3.2)
            for axis in ("rx", "ry", "rz")
        ),
    ),
    apply=apply,
    outputs=("cable_length",),
    variable="pose",
    what="The tracker was set up anew: its frame is not that of the profile.",
    formula="y = h + t + exp([q]×)(c − h)",
    source="S. Umeyama, IEEE Trans. PAMI 13 (1991); B. K. P. Horn, J. Opt. Soc. Am. A 4 (1987)",
    looks_like="Position errors by a rigid motion, the same at any tension; all cables disagree.",
    confused_with=("home-length", "reflector-offset", "exit-point"),
    told_apart="Poses in a larger part of the workspace; fixed points of the frame measured too.",
    needs=("robot",),
    on_robot=frozenset({"platform"}),
)
