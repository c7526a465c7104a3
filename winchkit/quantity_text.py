"""Numbers as text: unit prefix by magnitude, digits by the standard deviation.

Inputs are SI and unrounded; the result is, for example, ``"247.4 ± 6.1 kN"``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import floor, isfinite, isnan, log10
from re import compile as pattern

_DEG = 57.29577951308232
_ANY = float("inf")
_Prefixes = tuple[tuple[float, str, float], ...]


def _prefixed(unit: str) -> _Prefixes:
    """Prefixes of a unit for at most three digits before the point; those of kN m are usual."""
    small = (1e-4, f"µ{unit}", 1e-6), (0.1, f"m{unit}", 1e-3)
    if unit.startswith("N"):
        return *small, (1e3, unit, 1.0), (_ANY, f"k{unit}", 1e3)
    return *small, (_ANY, unit, 1.0)


_PREFIXES: dict[str, _Prefixes] = {
    "m": ((1e-4, "µm", 1e-6), (1.0, "mm", 1e-3), (_ANY, "m", 1.0)),
    "N": ((0.01, "mN", 1e-3), (1e3, "N", 1.0), (1e6, "kN", 1e3), (_ANY, "MN", 1e6)),
    "N/m": ((1e3, "N/m", 1.0), (1e6, "N/mm", 1e3), (_ANY, "kN/mm", 1e6)),
    "N/s": ((1e-3, "N/h", 1 / 3600), (0.1, "N/min", 1 / 60), (_ANY, "N/s", 1.0)),
    "kg": ((0.1, "g", 1e-3), (_ANY, "kg", 1.0)),
    "kg/m": ((0.1, "g/m", 1e-3), (_ANY, "kg/m", 1.0)),
    "kg m^2": ((1e-7, "g cm²", 1e-7), (0.1, "kg cm²", 1e-4), (_ANY, "kg m²", 1.0)),
    "s": ((1e-3, "µs", 1e-6), (1.0, "ms", 1e-3), (_ANY, "s", 1.0)),
    "rad": ((1e-5, "µrad", 1e-6), (1e-3, "mrad", 1e-3), (_ANY, "°", 1 / _DEG)),
    "1/K": ((1e-2, "·10⁻⁶/K", 1e-6), (_ANY, "/K", 1.0)),
    "degC": ((_ANY, "°C", 1.0),),
    "%": ((_ANY, "%", 1e-2),),
    "1": ((_ANY, "", 1.0),),
} | {
    unit: _prefixed(unit)
    for unit in ("N m", "N m s", "N m/s", "N m/rad", "N s/m", "N/K", "m/s", "rad/s")
}
"""Per SI unit: upper limit of the magnitude, label, and SI value of the label's unit."""
_WITHIN_A_FIGURE = pattern(r"(?<=[\d±=]) | (?=[±=])|(?<=N) (?=m\b)|(?<=m) (?=s\b)")
_SIGNS = str.maketrans("-", "−")


@dataclass(frozen=True)
class PrintScale:
    """A unit in which values are printed."""

    label: str
    worth: float
    """SI value of the unit."""

    def text(self, value: float, digits: int = 3) -> str:
        """A value with its unit; ``unknown`` where it is NaN."""
        if isnan(value):
            return "unknown"
        return self.labelled(significant(value / self.worth, digits))

    def span(self, low: float, high: float | None) -> str:
        """Two values with one unit: ``0.084 to 0.334 N m``; one value where both are equal."""
        first, last = self.text(low), self.text(low if high is None else high)
        return last if first == last else f"{significant(low / self.worth)} to {last}"

    def labelled(self, number: str) -> str:
        """A formatted number followed by the unit."""
        tight = self.label in {"", "°", "/K"} or self.label.startswith("·")
        return f"{number}{self.label}" if tight else f"{number} {self.label}"


def scale_for(sizes: float | Sequence[float], unit: str) -> PrintScale:
    """The scale for the largest of some SI values; an unknown unit is kept."""
    values = [sizes] if isinstance(sizes, int | float) else sizes
    size = max((abs(v) for v in values if isfinite(v)), default=0.0)
    prefixes = _PREFIXES.get(unit, ((_ANY, unit, 1.0),))
    if size == 0.0:
        label, worth = next(((n, w) for _, n, w in prefixes if w == 1.0), prefixes[-1][1:])
        return PrintScale(label, worth)
    label, worth = next((n, w) for below, n, w in prefixes if size < below)
    return PrintScale(label, worth)


def quantity(value: float, unit: str, digits: int = 3) -> str:
    """An SI value in its best unit: ``quantity(0.00163, "m") == "1.63 mm"``."""
    return scale_for(value, unit).text(value, digits)


def with_std(value: float, std: float, unit: str, scale: PrintScale | None = None) -> str:
    """Value and standard deviation, the latter to two digits: ``247.4 ± 6.1 kN``."""
    if not isfinite(value) or not isfinite(std) or std <= 0:
        return (scale or scale_for(value, unit)).text(value)
    scale = scale or scale_for((value, std), unit)
    shown, deviation = value / scale.worth, std / scale.worth
    decimals = 1 - floor(log10(deviation))
    if round(deviation, decimals) >= 10 ** (2 - decimals):
        decimals -= 1
    both = f"{_fixed(shown, decimals)} ± {_fixed(deviation, decimals)}"
    return f"({both}){scale.label}" if scale.label.startswith("·") else scale.labelled(both)


def percent(share: float) -> str:
    """A share as per cent: ``0.934`` is ``93 %``; ``unknown`` where it is NaN."""
    if isnan(share):
        return "unknown"
    shown = 100 * share
    if 0 < shown < 0.1:
        return "under 0.1 %"
    return f"{_fixed(shown, 0 if abs(shown) >= 10 else 1)} %"


def significant(value: float, digits: int = 3) -> str:
    """A number to some significant digits, without an exponent between 1e-6 and 1e9."""
    if isnan(value):
        return "unknown"
    if not isfinite(value):
        return "∞" if value > 0 else "−∞"
    if value == 0:
        return "0"
    exponent = floor(log10(abs(float(f"{value:.{digits - 1}e}"))))
    if not -6 <= exponent < 9:
        return f"{value:.{digits - 1}e}".translate(_SIGNS)
    return _fixed(value, digits - 1 - exponent)


def between(low: float, high: float, unit: str, scale: PrintScale | None = None) -> str:
    """An SI interval with two digits of its width: ``236 to 259 kN``; one end: ``above 236 kN``."""
    known = [end for end in (low, high) if isfinite(end)]
    if not known:
        return "any value"
    scale = scale or scale_for(known, unit)
    if not isfinite(high) or not isfinite(low):
        return f"{'below' if isfinite(high) else 'above'} {scale.text(known[0])}"
    ends, apart = (low / scale.worth, high / scale.worth), abs(high - low) / scale.worth
    decimals = 1 - floor(log10(apart)) if apart > 0 else 2
    return f"{_fixed(ends[0], decimals)} to {scale.labelled(_fixed(ends[1], decimals))}"


def plain(value: float, digits: int = 4) -> str:
    """A number to four digits at most, without trailing zeros: ``0.02``, not ``0.0200``."""
    shown = f"{value:.{digits - 1}e}".partition("e")[0].lstrip("-").rstrip("0").replace(".", "")
    return significant(value, max(1, len(shown))) if isfinite(value) else significant(value)


def grouped(value: float) -> str:
    """A whole number with its thousands separated: ``22 503 365``."""
    return f"{value:,.0f}".replace(",", " ").translate(_SIGNS)


def unbroken(text: str) -> str:
    """Text with no-break spaces between numbers and units."""
    return _WITHIN_A_FIGURE.sub("\u00a0", text)


def _fixed(value: float, decimals: int) -> str:
    """A number with a fixed count of decimals; a negative count rounds before the point."""
    rounded = round(value, decimals) + 0.0
    return f"{rounded:.{max(decimals, 0)}f}".translate(_SIGNS)
