"""Lines of a robot as winches of their own: the profile and the effects of each."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

from winchkit.dynamics.c_code import identifier
from winchkit.effects.bind import terms_of
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.effects.effect import Effect
from winchkit.effects.placement import base_of, line_of_effect
from winchkit.effects.term import Term
from winchkit.model.stages import ROBOT_STAGES
from winchkit.robot.effects.bind import declared_terms, robot_with_effects
from winchkit.robot.geometry.robot import Robot
from winchkit.schema.profiles.robot import RobotProfile
from winchkit.schema.profiles.winch import WinchProfile


@dataclass(frozen=True)
class RobotLine:
    """A line as a winch whose cable has its length at home there."""

    name: str
    winch: WinchProfile
    terms: tuple[Term, ...]


def lines_of(profile: RobotProfile, catalogue: Catalogue | None) -> tuple[Robot, list[RobotLine]]:
    """The robot with its effects, and its lines with those of their winches and of the robot."""
    catalogue = catalogue or load_catalogue()
    robot = robot_with_effects(profile, catalogue)
    declared = [t for t in declared_terms(profile, catalogue) if t.effect.stage not in ROBOT_STAGES]
    found, used = [], set[str]()
    for name, winch, length in zip(robot.names, robot.winches, robot.home_length, strict=True):
        on_line = [t for t in declared if line_of_effect(t.effect) in ("", name)]
        reference = replace(winch.reference, cable_length=float(length))
        here = replace(winch, name=f"{profile.name}-{name}", reference=reference)
        while identifier(here.name) in used:  # As of lines 'A' and 'a'.
            here = replace(here, name=f"{here.name}-other")
        used.add(identifier(here.name))
        found.append(RobotLine(name, here, (*terms_of(winch, catalogue), *map(_of_winch, on_line))))
    return robot, found


def _of_winch(term: Term) -> Term:
    """An effect without the name of its line."""
    own = {f.name: getattr(term.effect, f.name) for f in fields(Effect)}
    return Term(Effect(**{**own, "id": base_of(term.effect)}), term.values)
