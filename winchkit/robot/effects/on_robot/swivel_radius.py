"""swivel-radius: the radius of a swivel pulley differs from the profile."""

from dataclasses import replace

from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, LinePlace, Stage


def apply(place: LinePlace, at: At, values: Values) -> LinePlace:
    """A line whose swivel pulley has the radius r + δr; a fixed exit point is unchanged."""
    if not place.swivel_radius:
        return place
    return replace(place, swivel_radius=place.swivel_radius + values["radius_error"])


EFFECT = Effect(
    id="swivel-radius",
    stage=Stage.LINE_PLACE,
    parameters=(Parameter("radius_error", "m", null=0.0, typical=4e-4, low=-0.05, high=0.05),),
    apply=apply,
    outputs=("cable_length",),
    variable="pose",
    what="The swivel pulley's radius, to the middle of the cable, differs from the profile.",
    formula="ΔL = δr (wrap − sin wrap), to first order",
    source="A. Pott 2012, pulley kinematics; CABTIVE paper, Table 7 (7.7 to 8.5 for 8.6 mm)",
    looks_like="One line's length error that grows with the wrap angle on the pulley.",
    confused_with=("exit-point", "home-length"),
    told_apart="Poses from far below to near beside the pulley: the wrap must change much.",
    needs=("robot",),
    on_robot=frozenset({"one"}),
)
