"""The options ``--pay-out`` and ``--wind-in``: a direction with a positive speed or length."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import click

from winchkit.cli.core.options import Decorator, all_of
from winchkit.cli.core.quantities import dimension, quantity
from winchkit.cli.core.quantity_type import QuantityType
from winchkit.errors import UsageError

if TYPE_CHECKING:
    from winchkit.bench.direction import DirectionKeyword


@dataclass(frozen=True)
class Directed:
    """A speed or a length with its direction, as typed."""

    option: str
    value: float
    """In SI, above zero."""
    pays_out: bool
    dimension: str

    @property
    def length(self) -> DirectionKeyword:
        """The length (m) by the keyword of its direction; raises UsageError for a speed."""
        return self._keyword("length", "50mm")

    @property
    def speed(self) -> DirectionKeyword:
        """The speed (m/s) by the keyword of its direction; raises UsageError for a length."""
        return self._keyword("speed", "0.1m/s")

    def _keyword(self, wanted: str, example: str) -> DirectionKeyword:
        if self.dimension != wanted:
            raise UsageError(
                f"{self.option} is a {self.dimension} here and must be a {wanted}, such as "
                f"{self.option} {example}"
            )
        return {"pay_out": self.value} if self.pays_out else {"wind_in": self.value}


def direction_options(value: str) -> Decorator:
    """Add --pay-out and --wind-in; ``value`` says what they take, e.g. ``SPEED|LENGTH``."""
    kind = QuantityType("speed", "length", example="50 mm")
    return all_of(
        click.option("--pay-out", metavar=value, type=kind, help="Lengthen the cable."),
        click.option("--wind-in", metavar=value, type=kind, help="Shorten the cable."),
    )


def read_direction(pay_out: str | None, wind_in: str | None) -> Directed | None:
    """The given one of the two options; None for neither. Raises UsageError for both, or a sign."""
    if pay_out is not None and wind_in is not None:
        raise UsageError("--pay-out and --wind-in are opposite directions; give one of them")
    option, text = ("--pay-out", pay_out) if wind_in is None else ("--wind-in", wind_in)
    if text is None:
        return None
    kind = dimension(text, ("speed", "length"))
    return Directed(option, magnitude(option, text, kind), pay_out is not None, kind)


def magnitude(option: str, text: str, kind: str) -> float:
    """A quantity above zero; raises UsageError for a sign, since an option is no direction."""
    value = quantity(text, kind)
    if not 0 < value < float("inf"):
        raise UsageError(
            f"{option} {text}: must be above zero; --pay-out and --wind-in give the direction"
        )
    return value
