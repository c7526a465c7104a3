"""Values of a browser's messages: each is what it must be, or refused with a sentence.

JSON has NaN, infinities, null, booleans, text and integers of any size where a number is due; none
of them is a length or a speed.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from typing import Any

from winchkit.errors import UsageError

Message = Mapping[str, Any]

_LARGEST = 4_000
"""Bytes of a message of a browser."""
_SHOWN = 40
"""Characters of a wrong value that a sentence repeats."""


def decoded(message: str) -> Message:
    """A message as an object; raises UsageError."""
    try:
        found = json.loads(message) if len(message) <= _LARGEST else None
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise UsageError(f"the message is no JSON object of at most {_LARGEST} characters")
    return found


def length(asked: Message, key: str) -> float:
    """A length, m, zero or more; raises UsageError."""
    return _number(asked, key, "a length", "Type metres, for example 2.5.", lambda v: v >= 0)


def change(asked: Message, key: str) -> float:
    """A change of a length, m, or of an angle, rad, not zero; raises UsageError."""
    return _number(asked, key, "a change of length", "Give metres, for example 0.01.", bool)


def speed(asked: Message) -> float:
    """A speed, m/s, above zero; raises UsageError."""
    return _number(asked, "speed", "a speed", "Give m/s, for example 0.05.", lambda v: v > 0)


def signed_speed(asked: Message) -> float:
    """A speed, m/s, not zero; raises UsageError."""
    return _number(asked, "speed", "a speed", "Give m/s, for example 0.05.", bool)


def name(
    asked: Message, key: str, known: Mapping[str, object] | tuple[str, ...], what: str = ""
) -> str:
    """One of the known names of ``what``, by default the key; raises UsageError."""
    value = text(asked, key)
    if value not in known:
        words = f"{_quoted(value)} is no {what or key}"
        raise UsageError(f"{words}; there are {', '.join(known)}")
    return value


def text(asked: Message, key: str) -> str:
    """A text that is not empty; raises UsageError."""
    value = asked.get(key)
    if not isinstance(value, str) or not value:
        raise UsageError(f"{_quoted(value)} is no name of a {key}.")
    return value


def _number(
    asked: Message, key: str, what: str, remedy: str, fits: Callable[[float], bool]
) -> float:
    value = asked.get(key)
    if isinstance(value, int | float) and not isinstance(value, bool):
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if math.isfinite(number) and fits(number):
            return number
    if value is None:
        raise UsageError(f"No {what.removeprefix('a ')} is given. {remedy}")
    raise UsageError(f"{_quoted(value)} is not {what}. {remedy}")


def _quoted(value: object) -> str:
    """A wrong value in quotation marks, shortened."""
    words = value if isinstance(value, str) else json.dumps(value)
    return f'"{words if len(words) <= _SHOWN else words[:_SHOWN] + "…"}"'
