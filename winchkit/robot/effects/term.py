"""Terms on robots: effects with values, as modifiers of its lines, payload and tracker."""

from __future__ import annotations

from collections.abc import Iterable

from winchkit.effects.placement import HOME, line_of_effect
from winchkit.effects.term import Term
from winchkit.model.stages import Modifier, Stage
from winchkit.robot.geometry.robot import Robot, modified, robot_of
from winchkit.schema.profiles.robot import RobotProfile


def robot_with_terms(profile: RobotProfile, terms: Iterable[Term]) -> Robot:
    """The robot with these effects in place of its own.

    Parameters
    ----------
    profile : RobotProfile
        The robot.
    terms : iterable of Term
        Effects with values, in place of those of the profile.

    Returns
    -------
    Robot
        Kinematic model.
    """
    return modified_by_terms(robot_of(profile), terms)


def modified_by_terms(nominal: Robot, terms: Iterable[Term]) -> Robot:
    """The robot without effects, with these."""
    lines: dict[str, list[Modifier]] = {name: [] for name in nominal.names}
    payload: list[Modifier] = []
    tracker: list[Modifier] = []
    for term in terms:
        modifier, place = term.modifier(), line_of_effect(term.effect)
        if term.effect.stage is Stage.PAYLOAD:
            payload.append(modifier)
            continue
        if term.effect.stage is Stage.TRACKER:
            tracker.append(modifier)
            continue
        for name in [place] if place else lines:
            lines[name].append(modifier)
            if offset := term.values.get(HOME + name):
                lines[name].append(Modifier(Stage.HOME_LENGTH, _Longer(offset)))
    return modified(nominal, list(lines.values()), payload, tracker)


class _Longer:
    """A constant additional cable length."""

    def __init__(self, offset: float) -> None:
        self.offset = offset

    def __call__(self, length: float, at: object) -> float:
        return length + self.offset
