"""Placement of effects on a robot: on one line, or on all lines alike.

A placed effect is an effect too, so that selection, fit and report are the same as for winches.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace

from winchkit.effects.effect import Effect, Parameter

HOME = "home_length_"
"""Prefix of the home lengths that a cable's law has on a robot, one per line."""
_HOME_TYPICAL = 1e-3
"""m: a home pose is set to about a millimetre by hand."""


@dataclass(frozen=True)
class LineEffect(Effect):
    """An effect on one line of a robot; its id is ``EFFECT/LINE``."""

    base: str = ""
    """Id of the effect itself."""
    line: str = ""


def at_line(effect: Effect, line: str) -> LineEffect:
    """An effect placed on one line, with the id ``EFFECT/LINE``."""
    own = {f.name: getattr(effect, f.name) for f in fields(Effect)}
    own["id"] = f"{effect.id}/{line}"
    own["contains"] = tuple(f"{name}/{line}" for name in effect.contains)
    return LineEffect(**own, base=effect.id, line=line)


def with_home_lengths(effect: Effect, lines: Sequence[str]) -> Effect:
    """A law of the cable with a home length, m, for each given line on which it acts: the law gives
    the strain relative to home, where the cables are strained too, by unknown tensions.
    """
    place = line_of_effect(effect)
    on = [line for line in lines if place in ("", line)]
    homes = tuple(
        Parameter(HOME + line, "m", null=0.0, typical=_HOME_TYPICAL, low=-1.0, high=1.0)
        for line in on
    )
    contains = (*effect.contains, *(f"home-length/{line}" for line in on))
    parameters = (*effect.parameters, *homes)
    return replace(effect, parameters=parameters, contains=contains, probes=())


def base_of(effect: Effect) -> str:
    """Id of an effect without its place."""
    return effect.base if isinstance(effect, LineEffect) else effect.id


def line_of_effect(effect: Effect) -> str:
    """Line on which an effect is placed; empty where it acts on all."""
    return effect.line if isinstance(effect, LineEffect) else ""


def placements(effect: Effect, lines: Sequence[str], *, moving: bool = False) -> Iterator[Effect]:
    """Every placement of an effect on a robot, ``moving`` or at rest at its poses."""
    places = effect.places(moving=moving)
    if places & {"all", "platform"}:
        yield effect
    if "one" in places:
        yield from (at_line(effect, line) for line in lines)
