"""Capacity of a drum: turns and length of cable that it takes, and dead wraps.

A drum is full where its cable reaches the rim of the flange or the end of its width. It counts as
empty when only the dead wraps, which hold the cable by friction, are left on it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import floor, inf, nan, pi
from typing import Literal

import numpy as np

from winchkit.model.drum import drum_of
from winchkit.schema.profiles.winch import WinchProfile

DEAD_WRAPS = 2.0
"""Least number of turns on a drum under load (29 CFR 1910.179(h)(2)(iii)(a), wire ropes).

Fibre cables of low friction need more: Samson requires eight for AmSteel-Blue.
"""
_TURN = 2 * pi
_ROUNDING = 1e-9
"""Relative; a whole number of layers or turns stays whole in the division of rounded decimals."""


@dataclass(frozen=True)
class Capacity:
    """Capacity of a drum."""

    turns: float
    """Most turns on the drum; NaN where the profile has neither width nor flange."""
    length: float
    """Cable on the drum at that many turns, m; NaN in the same case."""
    limited_by: Literal["width", "flange", ""]
    """Dimension of the drum that is reached first; empty where unknown."""


def capacity(profile: WinchProfile) -> Capacity:
    """Capacity of a profile's drum, by ``drum.width`` and ``drum.flange_radius``; NaN where neither
    is declared.

    A grooved drum holds width/pitch turns in one layer (Eq. 12 of the winding-device paper). On a
    layered drum every turn lies on the one before; the cable's outer side may reach the flange.
    """
    by_width, by_flange = _turns_in_width(profile), _turns_under_flange(profile)
    turns = min(by_width, by_flange)
    if turns == inf:
        return Capacity(nan, nan, "")
    length = float(drum_of(profile).wound(np.asarray(_TURN * turns)))
    return Capacity(turns, length, "width" if by_width <= by_flange else "flange")


def _turns_in_width(profile: WinchProfile) -> float:
    """Grooves within the width; infinite for a layered drum, which is as wide as its cable."""
    drum = profile.drum
    if drum.width is None or drum.kind != "grooved" or not drum.groove_pitch:
        return inf
    return drum.width / drum.groove_pitch


def _turns_under_flange(profile: WinchProfile) -> float:
    """Turns until the cable's outer side reaches the flange's rim."""
    drum = profile.drum
    if drum.flange_radius is None or drum.kind == "grooved":
        return inf
    room = drum.flange_radius - (profile.cable.diameter or 0.0) / 2 - drum.winding_radius
    if drum.kind == "squared":
        # The radius is r0 + k Φ/2, thus r0 + π k a turn.
        growth = pi * (drum.build_up or 0.0)
    else:
        layer = drum.layer_growth
        growth = (layer if layer is not None else profile.cable.diameter) or 0.0
    if room < 0:
        return 0.0
    if growth == 0.0:
        return inf
    if drum.kind == "spiral":
        return floor(room / growth + _ROUNDING) + 1.0
    return room / growth


def turns_at(profile: WinchProfile, cable_length: float) -> float:
    """Turns on the drum at a free cable length (m); NaN without ``reference.cable_length``."""
    reference = profile.reference
    if reference.cable_length is None:
        return nan
    drum = drum_of(profile)
    there = drum.wound(np.asarray(_TURN * reference.wound_turns))
    wound = float(there) + reference.cable_length - cable_length
    return float(drum.angle(np.asarray(wound))) / _TURN


def length_at(profile: WinchProfile, turns: float) -> float:
    """Free cable length with ``turns`` on the drum, m; NaN without ``reference.cable_length``."""
    reference = profile.reference
    if reference.cable_length is None:
        return nan
    drum = drum_of(profile)
    there, then = (
        drum.wound(np.asarray(_TURN * number)) for number in (reference.wound_turns, turns)
    )
    return reference.cable_length + float(there - then)


def safe_lengths(profile: WinchProfile) -> tuple[float, float]:
    """Free cable lengths between a full drum and the last two dead wraps, m; NaN where no
    dimension, or no reference, is declared."""
    return length_at(profile, capacity(profile).turns), length_at(profile, DEAD_WRAPS)


def drum_warnings(
    profile: WinchProfile, shortest: float | None = None, longest: float | None = None
) -> Iterator[tuple[str, str]]:
    """Warnings about ends of the stroke, by default the reference, that exceed the drum's capacity;
    none without ``reference.wound_turns``."""
    reference = profile.reference
    if not reference.wound_turns:
        return
    fewest = reference.wound_turns if longest is None else turns_at(profile, longest)
    most = reference.wound_turns if shortest is None else turns_at(profile, shortest)
    where = "" if longest is None else f" at a cable length of {longest:g} m"
    if fewest < DEAD_WRAPS:
        yield (
            "reference.wound_turns",
            f"{fewest:.3g} turns are left on the drum{where}; "
            f"keep at least {DEAD_WRAPS:g} dead wraps",
        )
    room = capacity(profile)
    where = "" if shortest is None else f" at a cable length of {shortest:g} m"
    if most > room.turns * (1 + _ROUNDING):
        key = "drum.width" if room.limited_by == "width" else "drum.flange_radius"
        yield (
            key,
            f"the drum takes {room.turns:.4g} turns ({room.length:.4g} m of cable) but holds "
            f"{most:.4g}{where}; it is overfilled",
        )
