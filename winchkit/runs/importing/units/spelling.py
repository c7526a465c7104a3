"""Units in the cells of a header: alone, behind a name, or in brackets."""

from __future__ import annotations

import re
from collections.abc import Collection
from functools import lru_cache

from winchkit.runs.importing.units.known import COUNTS, SpelledUnit, known_unit

_LONGEST = 200
"""Longest name with a unit, characters."""
_PAIRS = {"[": "]", "(": ")", "{": "}"}
_NO_UNIT = {"", "-", "--", "none", "n/a", "1", "/", "[]", "()", "bool", "no unit", "unitless"}
_QUANTITY = "rotation"
"""A unit behind a name; in a row of its own the quantity of several columns (OptiTrack)."""


_SIZE = r"(?:\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?|10\s?\^\s?-?\d+|1\s?/\s?\d+)"
_SCALED = re.compile(
    rf"[x×*/]?\s*(?P<before>{_SIZE})\s*[x×*]?\s*(?P<unit>[^\W\d].*|[°%‰].*)"
    rf"|(?P<unit2>[^\W\d].*?|[°%‰])\s*[x×*/]\s*(?P<after>{_SIZE})"
)
"""``0.1 rpm``, ``rpm x 10``: a unit and its multiple."""


@lru_cache(4096)
def read_unit(text: str) -> SpelledUnit | None:
    """The unit of a spelling, with or without brackets; None for another text."""
    if len(text) > _LONGEST:
        return None
    inner = _inner(text)
    # "V (Voltage)", "A(rms)" and "% of rated": a unit with a description.
    first = re.split(r"\s+(?:\(|of\b)", inner)[0]
    for spelling in (inner, first):
        if (found := known_unit(spelling)) is not None:
            return found
    return None


def is_multiple(text: str) -> bool:
    """Whether a text is a unit with a number (``0.1 rpm``): the size of 1, or a range."""
    found = _SCALED.fullmatch(_inner(text))
    is_unit = found is not None and read_unit(found["unit"] or found["unit2"]) is not None
    return is_unit and read_unit(text) is None


def _inner(text: str) -> str:
    stripped = text.strip()
    if len(stripped) > 1 and (_PAIRS | {"<": ">"}).get(stripped[0]) == stripped[-1]:
        return stripped[1:-1].strip()
    return stripped


def split_unit(text: str) -> tuple[str, str]:
    """Name and unit of ``Torque (Nm)``, ``speed/rpm``, ``pos_deg``, ``Kraft in N`` or ``t, s``.

    The unit is empty where the cell has none that is known; one in brackets need not be known.
    """
    bracketed = _in_brackets(text)
    if bracketed is not None:
        return bracketed
    plain = text.strip()
    best = plain, ""
    if len(plain) > _LONGEST:
        return best
    for mark in (r"\s*/\s*", r"\s+in\s+", r"\s*,\s*", r"_", r"\s+", r"\."):
        for cut in re.finditer(rf"(?<=[^\s/]){mark}", plain):
            unit = plain[cut.end() :]
            known = read_unit(unit)
            # "Force 1 kN" has a number of its own, "speed 0.1 rpm" a multiple.
            is_size = is_multiple(unit) and not re.match(r"\d+\s*[^\W\d]", unit)
            if known is None and is_size and not best[1]:
                best = plain[: cut.start()], unit
            # The longest unit: ``speed_rad/s`` is not in seconds.
            is_longer = len(unit) > len(best[1]) and not is_multiple(best[1])
            if known is not None and is_longer and _is_safe(unit, mark, known):
                best = plain[: cut.start()], unit
    return best


def _in_brackets(text: str) -> tuple[str, str] | None:
    """Name and unit of a cell by its brackets, which may be nested; None without a unit.

    The last known unit is the unit: ``Force (Load Cell 1 (N))``, ``Torque [Nm] (filtered)``. A
    bracket at the end that has no known unit has an unknown one where it is square: an index
    (``pos[0]``) is part of the name.
    """
    found = [item for item in _brackets(text) if text[: item[0]].strip()]
    end = len(text.rstrip())
    for start, stop, inner in reversed(found):
        known = read_unit(inner)
        is_sure = stop == end or text[start] != "(" or inner.casefold() not in _SHORT_WORDS
        if known is not None and is_sure and not inner.isdecimal():
            rest = re.sub(r"\(\s*\)|\[\s*\]|\{\s*\}", "", f"{text[:start]} {text[stop:]}")
            return re.sub(r"\s+([)\]}])", r"\1", " ".join(rest.split())), inner
    last = next((item for item in found if item[1] == end), None)
    if last is None:
        return None
    start, _, inner = last
    is_square, is_apart = text[start] == "[", text[start - 1].isspace()
    if inner.isdecimal() and not (is_square and is_apart and inner in _NO_UNIT):
        return (text.strip(), "") if is_square else None
    if inner.lower() in _NO_UNIT:
        return text[:start].strip(), ""
    return (text[:start].strip(), inner) if is_square or is_multiple(inner) else None


def _brackets(text: str) -> list[tuple[int, int, str]]:
    """Start, end and content of every pair of brackets, in the order of their ends."""
    found, opened = [], list[int]()
    for index, char in enumerate(text[:_LONGEST]):
        if char in _PAIRS:
            opened.append(index)
        elif opened and char == _PAIRS[text[opened[-1]]]:
            start = opened.pop()
            found.append((start, index + 1, text[start + 1 : index].strip()))
    return found


_SHORT_WORDS = frozenset(
    ["in", "a", "p", "t", "c", "k", "f", "h", "d", "g", "u", "r", "ct", "tr", "rot", "''"]
)
_PLAIN_WORDS = {"count", "counts", "steps", "rotation", "rotations", "cycles", "pulses", "tour"}
"""Words of names that are also units."""


def _is_safe(unit: str, mark: str, known: SpelledUnit) -> bool:
    """Whether a word at the end of a name is a unit, and not a part of the name.

    ``joint_position_in``, ``motor_a`` and ``load_t`` have names of one or two letters; ``pos_rad``
    and ``torque_Nm`` have units. A low line within a unit is a slash (``rad_s``), or precedes an
    index of it (``A_rms``): ``st_t_r`` is a name.
    """
    inner = re.sub(r"(?i)_(rms|eff)$", "", unit)
    if "_" in inner and read_unit(inner.replace("_", "/")) is None:
        return False
    if mark in {r"\s*/\s*", r"\s+in\s+", r"\s*,\s*"}:
        return True
    word = unit.strip()
    if word.casefold() in _SHORT_WORDS:
        return False
    if word.casefold() in _PLAIN_WORDS:
        return known.dimension == COUNTS
    return word not in {"m", "s", "N", "V", "min"} or mark == "_"


def unit_as_name(name: str) -> SpelledUnit | None:
    """The unit that is all of a name: ``ms``, ``rad_s``; ``t_r`` is a name with an index."""
    word = name.strip().replace("_", "/")
    if len(word) < 2 or word.casefold() in {*_SHORT_WORDS, *_PLAIN_WORDS, "min"}:
        return None
    return read_unit(word)


def named_unit(name: str, dimensions: Collection[str]) -> SpelledUnit | None:
    """The one unit that is a word of a name without a unit at its end: ``speed_rpm_left``."""
    found = set()
    for word in re.split(r"[^A-Za-z°]+", name[:_LONGEST]):
        unit = read_unit(word)
        is_word = len(word) < 2 or word.casefold() in {*_SHORT_WORDS, *_PLAIN_WORDS}
        if unit is not None and not is_word and unit.dimension in dimensions:
            found.add(unit)
    return found.pop() if len(found) == 1 else None


def is_unit_row(cells: list[str]) -> bool:
    """Whether at least half of the cells with text of a row are units."""
    given = [cell.strip() for cell in cells if cell.strip()]
    units = [cell for cell in given if cell.casefold() != _QUANTITY and read_unit(cell)]
    neutral = [cell for cell in given if cell.lower().strip("[](){}") in _NO_UNIT]
    return bool(units) and len(units) + len(neutral) >= 0.5 * len(given)
