"""The direction of a motion as a caller names it: exactly one of ``pay_out`` and ``wind_in``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypedDict

from winchkit.arguments import number
from winchkit.errors import UsageError


class DirectionKeyword(TypedDict, total=False):
    """The one of the two keywords that a call is given, with its positive number."""

    pay_out: float
    wind_in: float


def directed(change: float) -> DirectionKeyword:
    """The keyword for a signed number, positive paying out; zero has none and is refused."""
    return {"wind_in": -change} if change < 0 else {"pay_out": change}


def paid_out(what: str, pay_out: float | None, wind_in: float | None) -> float:
    """The one that is given, positive paying out; raises UsageError unless it is one above zero."""
    if (pay_out is None) == (wind_in is None):
        count = "neither" if pay_out is None else "both"
        raise UsageError(f"{what} needs one of pay_out= and wind_in=, and has {count}")
    name, given = ("wind_in", wind_in) if pay_out is None else ("pay_out", pay_out)
    value = number(what, name, given)
    if value <= 0:
        raise UsageError(
            f"{what}: {name}={value:g} is not a positive number; the name gives the direction, "
            "write pay_out=0.1 or wind_in=0.1"
        )
    return value if wind_in is None else -value


def no_positional(call: str, unit: str, given: Sequence[object]) -> None:
    """Raise UsageError for values without a name: their sign would give the direction."""
    if given:
        raise UsageError(
            f"{call}({', '.join(map(repr, given))}): a number without a name does not give the "
            f"direction; write {call}(pay_out=...) or {call}(wind_in=...) with a positive number "
            f"({unit}), and every other argument by name"
        )
