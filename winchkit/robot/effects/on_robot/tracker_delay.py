"""tracker-delay: the tracker's readings are late, or its clock differs from the bench's."""

from dataclasses import replace

from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage
from winchkit.robot.geometry.tracker import Tracker


def apply(tracker: Tracker, at: At, values: Values) -> Tracker:
    """A tracker that shows the pose of a time τ before."""
    return replace(tracker, delay=tracker.delay + values["delay"])


EFFECT = Effect(
    id="tracker-delay",
    stage=Stage.TRACKER,
    parameters=(Parameter("delay", "s", null=0.0, typical=5e-3, low=-1.0, high=1.0),),
    apply=apply,
    outputs=("cable_length",),
    what="The tracker's readings are late: exposure, computation and network, or another clock.",
    formula="y(t) = h(c(t − τ), R(t − τ))",
    source="uniform motion: the distance by which a reading lags is the speed times the delay",
    looks_like="Position errors along the motion, in proportion to the speed, none at rest.",
    confused_with=("tracker-frame",),
    told_apart="The same path at two speeds, or in both directions.",
    needs=("robot",),
    order=2,
    in_motion=frozenset({"platform"}),
)
