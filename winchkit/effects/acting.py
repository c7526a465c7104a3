"""One effect at work: its function called, and whatever is wrong with it told with its place."""

from __future__ import annotations

from traceback import extract_tb
from typing import Any

import numpy as np

from winchkit.effects.effect import Effect, Values
from winchkit.errors import Fault, FileError, WinchkitError
from winchkit.model.stages import At

__all__ = ["act"]


def act(effect: Effect, values: Values, value: Any, at: At) -> Any:
    """What an effect makes of the value of its stage.

    Raises FileError with file and line where its function, perhaps a user's own, raises or does
    not give as many numbers as it was given.
    """
    try:
        after = effect.apply(value, at, values)
    except WinchkitError:
        raise
    except Exception as error:
        place = extract_tb(error.__traceback__)[-1]
        message = f"effect '{effect.id}': its function fails: {error!r}; mend it there"
        raise FileError(Fault(message, place.filename, place.lineno)) from error
    if isinstance(value, np.ndarray) and np.shape(after) != value.shape:
        code = getattr(effect.apply, "__code__", None)
        gives = "nothing" if after is None else f"values of shape {np.shape(after)}"
        message = (
            f"effect '{effect.id}': its function gives {gives} for values of shape "
            f"{value.shape}; return an array of the same shape, e.g. value + ..."
        )
        place_of = (code.co_filename, code.co_firstlineno) if code is not None else ("", None)
        raise FileError(Fault(message, *place_of))
    return after
