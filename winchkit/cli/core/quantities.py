"""Quantities as people type them at a prompt: the space before the unit may be missing."""

from __future__ import annotations

from winchkit.errors import UsageError
from winchkit.schema.plausible import typed_quantity
from winchkit.units import UNITS, article, number_and_unit, own_spelling, point_hint


def quantity(text: str, dimension: str) -> float:
    """``"0.1m/s"`` or ``"0.1 m/s"`` in SI; raises UsageError, also for a time below zero."""
    value = typed_quantity(text, dimension)
    if dimension == "time" and value < 0:
        raise UsageError(f"'{text}' is below zero; a duration is not")
    return value


def check_typed(option: str, text: str, *dimensions: str, example: str = "") -> None:
    """Check a quantity that was typed for an option; UsageError with an example."""
    faults = []
    for name in dimensions:
        try:
            quantity(text, name)
        except UsageError as error:
            faults.append(str(error))
        else:
            return
    fits = [name for name in dimensions if _has_unit_of(text, name)]
    example = example or f"2 {next(unit for unit in UNITS[dimensions[0]] if unit != '1')}"
    if fits:  # A number beyond its bounds, which the message of that bound gives.
        raise UsageError(f"{option}: {faults[dimensions.index(fits[0])]} (such as '{example}')")
    wanted = " or ".join(article(name) for name in dimensions)
    units = "; ".join(f"{name} {', '.join(UNITS[name])}" for name in dimensions)
    is_bare = number_and_unit(text) is not None and not _unit(text)
    fault = f"has no unit of {wanted}" if is_bare else f"is not {wanted} with its unit"
    how = point_hint(text) or f"; write such as '{example}' ({units})"
    raise UsageError(f"{option}: '{text}' {fault}{how}")


def dimension(text: str, among: tuple[str, ...]) -> str:
    """Which of these dimensions the unit of ``text`` has; raises UsageError for none of them."""
    for name in among:
        if _has_unit_of(text, name):
            return name
    units = "; ".join(f"{name} {', '.join(UNITS[name])}" for name in among)
    raise UsageError(f"'{text}' is no {' or '.join(among)} with its unit ({units})")


def optional(text: str | None, dimension: str) -> float | None:
    """A quantity; None where none is given."""
    return None if text is None else quantity(text, dimension)


def seconds(text: str | None) -> float | None:
    """A duration; None where none is given."""
    return optional(text, "time")


def _has_unit_of(text: str, dimension: str) -> bool:
    return own_spelling(_unit(text), UNITS[dimension]) in UNITS[dimension]


def _unit(text: str) -> str:
    """The unit of a quantity as typed; empty without one."""
    found = number_and_unit(text)
    return found[1] if found else ""
