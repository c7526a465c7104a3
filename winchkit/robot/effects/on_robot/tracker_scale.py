"""tracker-scale: distances measured by the tracker are too long or too short."""

from dataclasses import replace

from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage
from winchkit.robot.geometry.tracker import Tracker


def apply(tracker: Tracker, at: At, values: Values) -> Tracker:
    """A tracker whose readings are scaled about the origin of its frame."""
    size = 1 + values["scale_error"]
    shift = size * (tracker.home + tracker.shift) - tracker.home
    return replace(tracker, shift=shift, scale=(1 + tracker.scale) * size - 1)


EFFECT = Effect(
    id="tracker-scale",
    stage=Stage.TRACKER,
    parameters=(Parameter("scale_error", "1", null=0.0, typical=1e-4, low=-0.1, high=0.1),),
    apply=apply,
    outputs=("cable_length",),
    variable="pose",
    what="The tracker's scale is wrong: refractive index, or the wand of a camera system.",
    formula="(1 + s) y",
    source="ISO 10360-10 (laser trackers)",
    looks_like="Position errors in proportion to the distance from the origin of the frame.",
    confused_with=("drum-radius", "exit-point", "tracker-frame"),
    told_apart="Poses far from home in all directions; a scale bar measured beside them.",
    needs=("robot",),
    order=1,
    on_robot=frozenset({"platform"}),
)
