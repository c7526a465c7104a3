"""Charts as SVG inside a page, drawn without script, so that they can be printed.

Colours are classes of the page (``before``, ``after``, ``residual``, ``quiet``), for light and dark
styles; lengths are those of the view box, 480 wide, so that texts remain legible on a small screen.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import ceil, floor, log10
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from winchkit.model.variables import ANGLES, VARIABLE_UNITS
from winchkit.report.html.markup import Markup, element
from winchkit.report.words.numbers import plain
from winchkit.report.words.vocabulary import VARIABLE_NAMES

__all__ = [
    "Axis",
    "Chart",
    "Reading",
    "axis_over",
    "legend",
    "reading",
]

_WIDTH, _HEIGHT = 480.0, 250.0
_LEFT, _RIGHT, _TOP, _BELOW = 62.0, 10.0, 10.0, 42.0
_TICKS = 6
_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)
_MARGIN = 0.06
_HALF = 1e-6


@dataclass(frozen=True)
class Axis:
    """One axis: label with unit, and range."""

    label: str
    low: float
    high: float
    logarithmic: bool = False

    def share(self, value: float) -> float:
        """Position of a value along the axis, 0 to 1."""
        if self.logarithmic:
            return (log10(value) - log10(self.low)) / (log10(self.high) - log10(self.low))
        return (value - self.low) / (self.high - self.low)

    @property
    def ticks(self) -> list[float]:
        """Round values within the range."""
        return _powers(self.low, self.high) if self.logarithmic else _even(self.low, self.high)


def axis_over(
    label: str, values: Iterable[float], *, logarithmic: bool = False, zero: bool = False
) -> Axis:
    """An axis for finite values with a margin, and with zero if requested."""
    held = [*values, *([0.0] if zero else [])] or [0.0]
    low, high = min(held), max(held)
    if logarithmic:
        return Axis(label, low / 1.25, high * 1.25, logarithmic=True)
    room = _MARGIN * (high - low) or abs(high) * _MARGIN or 1.0
    return Axis(label, low - room, high + room)


@dataclass(frozen=True)
class Chart:
    """A frame with two axes; marks are placed by :meth:`at` and drawn inside it."""

    x: Axis
    y: Axis
    words: str
    """Text alternative."""
    height: float = _HEIGHT

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Position of a point in the view box."""
        across = _LEFT + self.x.share(x) * (_WIDTH - _LEFT - _RIGHT)
        return across, _TOP + (1 - self.y.share(y)) * (self.height - _TOP - _BELOW)

    def line(self, points: Iterable[tuple[float, float]], tone: str) -> Markup:
        """A line through points, in a colour of the page."""
        path = " ".join("{:.1f},{:.1f}".format(*self.at(x, y)) for x, y in points)
        return element("polyline", points=path, class_="line", style=f"color:var(--{tone})")

    def dot(self, x: float, y: float, tone: str, said: str = "") -> Markup:
        """A dot with a tooltip."""
        across, down = self.at(x, y)
        inside = [element("title", said)] if said else []
        place = {"cx": f"{across:.1f}", "cy": f"{down:.1f}", "r": "3"}
        return element("circle", *inside, **place, style=f"fill:var(--{tone})")

    def cell(
        self, x: tuple[float, float], y: tuple[float, float], tone: str, strength: float, said: str
    ) -> Markup:
        """A filled cell between two corners; ``strength`` is its opacity, 0 to 1."""
        left, low = self.at(x[0], y[0])
        right, high = self.at(x[1], y[1])
        return element(
            "rect",
            element("title", said),
            x=f"{left:.1f}",
            y=f"{high:.1f}",
            width=f"{right - left:.1f}",
            height=f"{low - high:.1f}",
            style=f"fill:var(--{tone});fill-opacity:{strength:.2f}",
        )

    def draw(self, *marks: Markup) -> Markup:
        """The whole chart around its marks."""
        return element(
            "svg",
            *self._grid(),
            *marks,
            *self._frame(),
            viewBox=f"0 0 {_WIDTH:g} {self.height:g}",
            class_="chart",
            role="img",
            aria_label=self.words,
        )

    def _grid(self) -> Iterable[Markup]:
        left, bottom = self.at(self.x.low, self.y.low)
        right, top = self.at(self.x.high, self.y.high)
        for tick in self.x.ticks:
            across, _ = self.at(tick, self.y.low)
            yield _rule((across, bottom), (across, top), tick, self.x)
            yield _words(plain(tick), across, bottom + 15)
        for tick in self.y.ticks:
            _, down = self.at(self.x.low, tick)
            yield _rule((left, down), (right, down), tick, self.y)
            yield _words(plain(tick), left - 6, down + 4, "end")

    def _frame(self) -> Iterable[Markup]:
        left, bottom = self.at(self.x.low, self.y.low)
        right, top = self.at(self.x.high, self.y.high)
        size = {"width": f"{right - left:.1f}", "height": f"{bottom - top:.1f}"}
        yield element("rect", x=f"{left:.1f}", y=f"{top:.1f}", class_="frame", **size)
        yield _words(self.x.label, (left + right) / 2, bottom + 33)
        middle = (top + bottom) / 2
        turned = f"rotate(-90 12 {middle:.1f})"
        yield _words(self.y.label, 12.0, middle, transform=turned)


def legend(entries: Sequence[tuple[str, str]]) -> Markup:
    """Legend of the page's colours, below a chart."""
    items = [
        element("li", element("span", class_="swatch", style=f"background:var(--{tone})"), text)
        for tone, text in entries
    ]
    return element("ul", *items, class_="legend")


def _rule(
    initial_model: tuple[float, float], end: tuple[float, float], tick: float, axis: Axis
) -> Markup:
    zero = not axis.logarithmic and abs(tick) < _HALF * (axis.high - axis.low)
    ends = {"x1": initial_model[0], "y1": initial_model[1], "x2": end[0], "y2": end[1]}
    return element(
        "line", class_="zero" if zero else "rule", **{name: f"{v:.1f}" for name, v in ends.items()}
    )


def _words(text: str, across: float, down: float, anchor: str = "middle", **more: str) -> Markup:
    place = {"x": f"{across:.1f}", "y": f"{down:.1f}", "text_anchor": anchor}
    return element("text", text, **place, **more)


def _even(low: float, high: float) -> list[float]:
    """Round values, evenly spaced, about six."""
    rough = (high - low) / _TICKS
    power = 10.0 ** floor(log10(rough))
    step = next(power * s for s in _STEPS if power * s >= rough * (1 - 1e-9))
    first, last = ceil(low / step - 1e-9), floor(high / step + 1e-9)
    return [n * step for n in range(first, last + 1)]


def _powers(low: float, high: float) -> list[float]:
    """1, 2 and 5 of every power of ten, or the powers alone over many decades."""
    powers = range(floor(log10(low)), ceil(log10(high)) + 1)
    digits = (1, 2, 5) if len(powers) < 4 else (1,)
    ticks = [digit * 10.0**power for power in powers for digit in digits]
    return [tick for tick in ticks if low <= tick <= high]


_Value = TypeVar("_Value", float, NDArray[np.float64])
_TURN = 2 * np.pi
_DEGREES = 360.0
_OF_PLATFORM = {f"platform_{axis}": ("m", 1.0) for axis in "xyz"} | {
    f"platform_{angle}": ("°", _TURN / _DEGREES) for angle in ("roll", "pitch", "yaw")
}


@dataclass(frozen=True)
class Reading:
    """Unit and label of a variable on an axis."""

    label: str
    """Its name with the unit."""
    unit: str
    worth: float = 1.0
    """SI value of the unit."""
    logarithmic: bool = False
    """Whether the variable is the logarithm (base 10) of the shown value."""

    def shown(self, values: _Value) -> _Value:
        """SI values in the unit of the axis."""
        return 10.0**values if self.logarithmic else values / self.worth


_WITH_A_SIGN = {
    "direction": Reading("direction (1 winds in, −1 pays out)", ""),
    "directed_length": Reading("free length, winding in; negative: paying out [m]", "m"),
}


def reading(variable: str, *, within_turn: bool = False) -> Reading:
    """Unit and label of a variable; an angle within its turn in degrees, else in turns."""
    name = VARIABLE_NAMES.get(variable, variable.replace("_", " "))
    if variable in ANGLES and within_turn:
        return Reading(f"{name} within its turn [°]", "°", _TURN / _DEGREES)
    if variable in ANGLES:
        return Reading(f"{name} [turns]", "turns", _TURN)
    if variable == "reversal_distance":
        return Reading(f"{name} [m]", "m", logarithmic=True)
    if variable in _WITH_A_SIGN:
        return _WITH_A_SIGN[variable]
    if variable in _OF_PLATFORM:
        unit, worth = _OF_PLATFORM[variable]
        return Reading(f"{name} [{unit}]", unit, worth)
    unit = {"degC": "°C", "1": ""}.get(own := VARIABLE_UNITS.get(variable, ""), own)
    return Reading(f"{name} [{unit}]" if unit else name, unit)
