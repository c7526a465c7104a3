"""Axes of figures: ranges, round ticks, and the unit and label of every variable."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import ceil, floor, isfinite, log10
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from winchkit.model.variables import ANGLES, VARIABLE_UNITS
from winchkit.quantity_text import plain
from winchkit.report.figures.figure import FigureAxis
from winchkit.report.words.vocabulary import variable_name

_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)
"""Round steps between ticks, of one decade."""
_FEWEST = 3
"""Ticks from which a reader sees the scale of an axis."""
_MARGIN = 0.06
"""Share of the range that stays free beyond the data, so that no line lies on the frame."""
_DECADES = 4
"""Decades of a logarithmic axis from which only its powers of ten have ticks."""


@dataclass(frozen=True)
class Range:
    """Ends of an axis, linear or logarithmic."""

    low: float
    high: float
    logarithmic: bool = False

    def share(self, value: float) -> float:
        """Position of a value along the axis, 0 to 1."""
        return float(self.shares(np.array([value]))[0])

    def shares(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Positions of values along the axis, (n,)."""
        if self.logarithmic:
            span = log10(self.high) - log10(self.low)
            with np.errstate(divide="ignore", invalid="ignore"):
                return np.asarray((np.log10(values) - log10(self.low)) / span)
        return np.asarray((values - self.low) / (self.high - self.low))

    def ticks(self, count: int) -> list[tuple[float, str]]:
        """Round values within the range, about ``count`` and at least three, with their texts."""
        if self.logarithmic:
            return [(v, plain(v)) for v in _powers(self.low, self.high)]
        every = (_even(self.low, self.high, more * count) for more in (1, 2, 3))
        step, values = next((e for e in every if len(e[1]) >= _FEWEST), (1.0, []))
        decimals = max(0, -floor(log10(step) + 1e-9))
        if abs(step * 10**decimals - round(step * 10**decimals)) > 1e-6:
            decimals += 1
        return [(v, f"{v + 0.0:.{decimals}f}".replace("-", "−")) for v in values]


def range_of(axis: FigureAxis, values: Iterable[float]) -> Range:
    """The range of an axis: its limits, else that of finite values with a margin."""
    if axis.limits is not None:
        return Range(*axis.limits, axis.logarithmic)
    held = [v for v in values if isfinite(v) and (v > 0 or not axis.logarithmic)]
    held = [*held, *([0.0] if axis.zero else [])] or [1.0]
    low, high = min(held), max(held)
    if axis.logarithmic:
        return Range(low / 1.25, high * 1.25, logarithmic=True)
    room = _MARGIN * (high - low) or abs(high) * _MARGIN or 1.0
    return Range(low - room, high + room)


def _even(low: float, high: float, count: int) -> tuple[float, list[float]]:
    """Step and round values, evenly spaced, at most ``count`` + 1."""
    rough = (high - low) / max(count, 1)
    power = 10.0 ** floor(log10(rough))
    step = next(power * s for s in _STEPS if power * s >= rough * (1 - 1e-9))
    first, last = ceil(low / step - 1e-9), floor(high / step + 1e-9)
    return step, [n * step for n in range(first, last + 1)]


def _powers(low: float, high: float) -> list[float]:
    """1, 2 and 5 of every power of ten, or the powers alone over many decades."""
    powers = range(floor(log10(low)), ceil(log10(high)) + 1)
    digits: Sequence[int] = (1, 2, 5) if len(powers) < _DECADES else (1,)
    ticks = [digit * 10.0**power for power in powers for digit in digits]
    return [tick for tick in ticks if low <= tick <= high]


_Value = TypeVar("_Value", float, NDArray[np.float64])
_TURN = 2 * np.pi
_DEGREES = 360.0
_OF_PLATFORM = {f"platform_{axis}": ("m", 1.0) for axis in "xyz"} | {
    f"platform_{angle}": ("°", _TURN / _DEGREES) for angle in ("roll", "pitch", "yaw")
}


@dataclass(frozen=True)
class AxisLabel:
    """Name and unit of a variable on an axis."""

    name: str
    unit: str
    worth: float = 1.0
    """SI value of the unit."""
    logarithmic: bool = False
    """Whether the variable is the logarithm (base 10) of the shown value."""
    categories: tuple[tuple[float, str], ...] = ()

    @property
    def label(self) -> str:
        """Its name with the unit."""
        return self.axis().label

    def shown(self, values: _Value) -> _Value:
        """SI values in the unit of the axis."""
        return 10.0**values if self.logarithmic else values / self.worth

    def axis(self, limits: tuple[float, float] | None = None) -> FigureAxis:
        """The axis of the variable."""
        return FigureAxis(
            self.name, self.unit, self.logarithmic, limits, categories=self.categories
        )


_WITH_A_SIGN = {
    "direction": AxisLabel(
        "direction", "", categories=((-1.0, "paying out"), (0.0, "at rest"), (1.0, "winding in"))
    ),
    "directed_length": AxisLabel("free length, winding in; negative: paying out", "m"),
    "directed_load": AxisLabel("load, winding in; negative: paying out", "N"),
    "directed_tension": AxisLabel("tension, winding in; negative: paying out", "N"),
}


def reading(variable: str, *, within_turn: bool = False) -> AxisLabel:
    """Unit and name of a variable; an angle ``within_turn`` in degrees, else in turns."""
    name = variable_name(variable)
    if variable in ANGLES:
        within = AxisLabel(f"{name} within its turn", "°", _TURN / _DEGREES)
        return within if within_turn else AxisLabel(name, "turns", _TURN)
    if variable == "position" and within_turn:
        return AxisLabel(f"{name} within its period", "mm", 1e-3)
    if variable == "reversal_distance":
        return AxisLabel(name, "m", logarithmic=True)
    if variable in _WITH_A_SIGN:
        return _WITH_A_SIGN[variable]
    if variable in _OF_PLATFORM:
        unit, worth = _OF_PLATFORM[variable]
        return AxisLabel(name, unit, worth)
    unit = {"degC": "°C", "1": ""}.get(own := VARIABLE_UNITS.get(variable, ""), own)
    return AxisLabel(name, unit)
