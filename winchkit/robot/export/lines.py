"""Lines of a robot as winches of their own: the profile and the effects of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

from winchkit.effects.bind import terms_of
from winchkit.effects.catalogue import Catalogue
from winchkit.effects.effect import Effect
from winchkit.effects.placement import base_of, line_of_effect
from winchkit.effects.term import Term
from winchkit.model.stages import ROBOT_STAGES
from winchkit.robot.effects.bind import robot_terms
from winchkit.robot.effects.term import robot_with_terms
from winchkit.robot.geometry.robot import Robot
from winchkit.schema.profiles.robot import RobotProfile
from winchkit.schema.profiles.winch import WinchProfile


@dataclass(frozen=True)
class RobotLine:
    """A line as a winch whose cable has its length at home there."""

    name: str
    winch: WinchProfile
    terms: tuple[Term, ...]


def lines_of(
    profile: RobotProfile, catalogue: Catalogue | None
) -> tuple[Robot, list[RobotLine], list[str]]:
    """The robot with its effects, its lines, and effects of its winches that act on none."""
    terms = robot_terms(profile, catalogue, moving=True)
    robot = robot_with_terms(profile, terms)
    found, left = [], list[str]()
    for name, winch, length in zip(robot.names, robot.winches, robot.home_length, strict=True):
        own = [t for t in terms if line_of_effect(t.effect) in ("", name)]
        own = [t for t in own if t.effect.stage not in ROBOT_STAGES]
        known = {base_of(t.effect) for t in own}
        left += [f"{t.label} of line {name}" for t in terms_of(winch, catalogue)
                 if t.effect.id not in known]  # fmt: skip
        reference = replace(winch.reference, cable_length=float(length))
        here = replace(winch, name=f"{profile.name}-{name}", reference=reference)
        found.append(RobotLine(name, here, tuple(_of_winch(own))))
    return robot, found, left


def _of_winch(terms: Sequence[Term]) -> list[Term]:
    """Effects without the name of their line."""
    out = []
    for term in terms:
        own = {f.name: getattr(term.effect, f.name) for f in fields(Effect)}
        out.append(Term(Effect(**{**own, "id": base_of(term.effect)}), term.values))
    return out
