"""Terms: effects with values, as modifiers of a line."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from traceback import extract_tb
from typing import Any

import numpy as np

from winchkit.effects.effect import Effect, Values
from winchkit.errors import Fault, FileError, WinchkitError
from winchkit.model.stages import At, Modifier

_ORDERS_IN_LABEL = 6
"""Numbers that a label lists; with the rest counted it fits a line of a report."""


def act(effect: Effect, values: Values, value: Any, at: At) -> Any:
    """Apply an effect with its values (SI) to the value of its stage, whose type and shape remain.
    Raises FileError with file and line where its function raises or returns another shape.
    """
    try:
        after = effect.apply(value, at, values)
    except WinchkitError:
        raise
    except Exception as error:
        place = extract_tb(error.__traceback__)[-1]
        message = f"effect '{effect.id}': its function fails: {error!r}; correct it there"
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


@dataclass(frozen=True)
class Term:
    """An effect with its values, in a profile or a hypothesis."""

    effect: Effect
    values: Mapping[str, float]

    @property
    def label(self) -> str:
        """Its id, with the order where it has one."""
        orders = [f"{self.values[p.name]:g}" for p in self.effect.parameters if p.whole]
        more = len(orders) - _ORDERS_IN_LABEL
        if more > 1:
            orders = [*orders[:_ORDERS_IN_LABEL], f"{more} more"]
        return self.effect.id + (f"[{', '.join(orders)}]" if orders else "")

    def modifier(self) -> Modifier:
        """The term as modifier of a line."""
        apply = partial(act, self.effect, self.values)
        undone = self.effect.correct
        correct = None if undone is None else partial(_corrected, undone, self.values)
        return Modifier(self.effect.stage, apply, self.effect.order, correct)


def _corrected(
    correct: Callable[[Any, At, Mapping[str, float]], Any],
    values: Mapping[str, float],
    value: Any,
    at: At,
) -> Any:
    """The value before an effect from the value after it."""
    return correct(value, at, values)


def modifiers_of(terms: Iterable[Term]) -> tuple[Modifier, ...]:
    """Modifiers of several terms, in their order."""
    return tuple(term.modifier() for term in terms)
