"""Binding of effects to a robot: its ``[[effect]]`` tables and those of its winches as terms.

A table with ``line = "1"`` acts on that line, a table without it on all lines or on the platform.
One table may have home lengths of several lines, ``length = { 1 = "0.4 mm", 2 = "-0.2 mm" }``.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from winchkit.effects.bind import not_in, terms_of, values_of
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.effects.effect import Effect
from winchkit.effects.placement import at_line
from winchkit.effects.term import Term
from winchkit.errors import Fault, FileError, suggest
from winchkit.robot.effects.term import robot_with_terms
from winchkit.robot.geometry.robot import Robot
from winchkit.schema.profiles.robot import RobotProfile
from winchkit.schema.profiles.winch import EffectTable, WinchProfile

_HOME_LENGTH = "home-length"


def robot_with_effects(profile: RobotProfile, catalogue: Catalogue | None = None) -> Robot:
    """The robot that a profile declares, its effects included. Raises FileError.

    Parameters
    ----------
    profile : RobotProfile
        The robot, with the profiles of its winches read.
    catalogue : Catalogue, optional
        Effects; by default all.

    Returns
    -------
    Robot
        Kinematic model with the modifiers of the effects.
    """
    return robot_with_terms(profile, robot_terms(profile, catalogue))


def robot_terms(
    profile: RobotProfile, catalogue: Catalogue | None = None, *, moving: bool = False
) -> tuple[Term, ...]:
    """Terms of a robot and of its lines' winches. Raises FileError with every fault.

    Effects that need a motion, such as friction, are left out of a robot at rest.

    Parameters
    ----------
    profile : RobotProfile
        The robot.
    catalogue : Catalogue, optional
        Effects; by default all.
    moving : bool
        Whether the robot moves.

    Returns
    -------
    tuple[Term, ...]
        Terms of the robot and of its winches.
    """
    catalogue = catalogue or load_catalogue()
    declared = declared_terms(profile, catalogue)
    terms = [term for term in declared if term.effect.places(moving=moving)]
    for line in profile.line:
        if isinstance(line.winch, WinchProfile):
            terms += [
                Term(at_line(term.effect, line.name), term.values)
                for term in terms_of(line.winch, catalogue)
                if term.effect.places(moving=moving)
            ]
    return tuple(terms)


def declared_terms(profile: RobotProfile, catalogue: Catalogue) -> list[Term]:
    """Terms of the robot's own tables alone. Raises FileError with every fault."""
    terms, faults = _bind(profile, catalogue)
    if faults:
        raise FileError(faults)
    return terms


def check_robot(profile: RobotProfile, catalogue: Catalogue | None = None) -> list[Fault]:
    """Every fault of the effects that a robot declares itself."""
    return _bind(profile, catalogue or load_catalogue())[1]


def lines_with_home_length(profile: RobotProfile) -> set[str]:
    """Lines whose home length the profile has as an effect already."""
    own = (table for table in _single(profile.effect) if table.id == _HOME_LENGTH)
    return {str(table.values["line"]) for table in own if "line" in table.values}


def _bind(profile: RobotProfile, catalogue: Catalogue) -> tuple[list[Term], list[Fault]]:
    terms: list[Term] = []
    faults: list[Fault] = []
    names = [line.name for line in profile.line]
    for table in _single(profile.effect):
        if table.id not in catalogue:
            faults.append(_fault(table, not_in(catalogue, table.id), "effect.id"))
            continue
        effect = catalogue[table.id]
        given = {key: value for key, value in table.values.items() if key != "line"}
        wrong = _misplaced(effect, table.values.get("line"), names)
        values, faulty = values_of(effect, replace(table, values=given))
        if wrong:
            faulty = [*faulty, _fault(table, wrong, f"effect {table.id}.line")]
        elif (place := table.values.get("line")) is not None:
            effect = at_line(effect, str(place))
        if not wrong and any(term.effect.id == effect.id for term in terms):
            message = "is declared twice for one line or for all; declare it once"
            faulty = [*faulty, _fault(table, message, f"effect {effect.id}")]
        faults += faulty
        terms.append(Term(effect, values))
    return terms, faults


def _single(tables: Iterable[EffectTable]) -> Iterator[EffectTable]:
    """Tables of one line each: home lengths of several lines are separated."""
    for table in tables:
        lengths = table.values.get("length")
        if table.id == _HOME_LENGTH and isinstance(lengths, Mapping):
            for line, length in lengths.items():
                yield replace(table, values={"line": line, "length": length})
        else:
            yield table


def _misplaced(effect: Effect, line: object, names: list[str]) -> str:
    """Fault of the place at which a table declares an effect; empty without a fault."""
    known = ", ".join(names)
    places = effect.places(moving=True)
    if not places:
        return (
            "acts in motion only, and a robot's poses are static; declare it for the line's winch"
        )
    if line is None and not places & {"all", "platform"}:
        return f'missing: this effect acts on one line, named as line = "{names[0]}"'
    if line is not None and "one" not in places:
        return "this effect acts on the robot as a whole; leave the line out"
    if line is not None and str(line) not in names:
        return f"no line '{line}'; the lines are {known}{suggest(str(line), names)}"
    return ""


def _fault(table: EffectTable, message: str, where: str) -> Fault:
    return Fault(message, table.path, table.line, where)
