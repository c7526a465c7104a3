"""Results on a linear axis with its names and units, for every text, table, plot and file.

The model has 1 m for 1 rad; a result that leaves it has ``force`` and ``position`` in place of
``motor_torque`` and ``motor_angle``, N in place of N m, and the same in its texts.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar, cast

from winchkit.effects.effect import Effect
from winchkit.errors import RunError, UsageError
from winchkit.schema.linear_axis import linear_words
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.profiles.winch import WinchProfile

T = TypeVar("T")
_AS_GIVEN = {"run", "runs", "path", "programme", "profile", "effect", "effects", "code"}
"""Fields with names of the user and of the catalogue."""
_AXIS = {"winch": "axis", "winches": "axes", "Winch": "Axis", "Winches": "Axes"}
_WINCH = re.compile(r"(?<![-\w./'\"])[Ww]inch(?:es)?(?![-\w/\"]|\.\w|&quot;)")
"""The word in a text; no option, file or key of that name."""
_DRUM = re.compile(r"\bdrum(?=\s+(?:angle|turn)\b)")


def in_units_of(profile: WinchProfile, result: T) -> T:
    """A result with the names and units of a profile: those of a linear axis where it is one; in
    texts on an axis "axis" replaces "winch", and "output" the "drum" of one that turns.
    """
    if isinstance(profile, AxisProfile) and isinstance(result, str):
        text = _WINCH.sub(lambda found: _AXIS[found[0]], result)
        result = cast(T, text if profile.is_linear else _DRUM.sub("output", text))
    return _linear(result) if profile.is_linear else result


@contextmanager
def errors_in_units_of(profile: WinchProfile) -> Iterator[None]:
    """Raise errors of the model with the names and units of a profile."""
    try:
        yield
    except RunError as error:
        if not profile.is_linear:
            raise
        raise RunError([_linear(fault) for fault in error.faults]) from None
    except UsageError as error:
        if not profile.is_linear:
            raise
        raise UsageError(linear_words(str(error))) from None


def _linear(value: Any) -> Any:
    if isinstance(value, str):
        return linear_words(value)
    if isinstance(value, Effect | WinchProfile):
        return value
    if is_dataclass(value) and not isinstance(value, type):
        new = {
            item.name: _linear(getattr(value, item.name))
            for item in fields(value)
            if item.init and item.name not in _AS_GIVEN
        }
        changed = {name: own for name, own in new.items() if own is not getattr(value, name)}
        return replace(value, **changed) if changed else value
    if isinstance(value, Mapping):
        return {_linear(key): _linear(own) for key, own in value.items()}
    if isinstance(value, list | tuple) and not hasattr(value, "_fields"):
        return type(value)(_linear(own) for own in value)
    return value
