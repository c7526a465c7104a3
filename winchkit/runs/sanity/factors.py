"""Known constants that explain a wrong factor or sign of a channel: units, counts, powers."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor, log, log10, pi

from winchkit.units import GRAVITY

_TOLERANCE = 0.05
"""Relative difference that errors of a profile's values may make on top of the uncertainty."""
_SIGMAS = 3.0
"""Standard deviations of the slope within which a known factor explains it."""
_LARGE = 1e4
"""From here a factor is written with an exponent."""
_FEWEST_BITS, _MOST_BITS = 7, 24
"""Of encoders and converters: 128 counts to 24 bits."""

_COMMON: tuple[tuple[float, str], ...] = (
    *((10.0**n, f"10^{n}, a power of ten (milli, percent, kilo …)") for n in (1, 2, 3, 4, 5, 6, 9)),
    *((2.0**n, f"2^{n}: counts") for n in range(_FEWEST_BITS, _MOST_BITS + 1)),
)
"""Constants of any channel."""
_OF_ANGLES: tuple[tuple[float, str], ...] = (
    (2 * pi, "2π: radians and turns"),
    (180 / pi, "180/π: degrees and radians"),
    (360.0, "360: degrees and turns"),
    (60.0, "60: per minute and per second"),
    (60 / (2 * pi), "60/(2π): rpm and rad/s"),
    (6.0, "6: rpm and deg/s"),
    (pi, "π: circumference and diameter"),
    *(
        (2.0**n / (2 * pi), f"2^{n}/(2π): counts of a turn and radians")
        for n in range(_FEWEST_BITS, _MOST_BITS + 1)
    ),
)
_OF_LOADS: tuple[tuple[float, str], ...] = (
    (GRAVITY, "9.81: kilograms and newtons"),
    (GRAVITY * 1e3, "9.81·10³: tonnes or grams and newtons"),
    (GRAVITY / 10, "0.981: decanewtons and kilograms"),
    (25.4, "25.4: inches and millimetres"),
    (1 / 0.0254, "1/0.0254: inches and metres"),
    (1 / 0.3048, "1/0.3048: feet and metres"),
    (4.4482216, "4.45: pounds-force and newtons"),
    (2.2046226, "2.20: pounds and kilograms"),
    (2.0, "2: diameter and radius, or a second fall of the cable"),
)
"""Constants of masses, forces and lengths."""
_OF_TORQUES: tuple[tuple[float, str], ...] = (
    (GRAVITY, "9.81: kilogram-force metres and newton metres"),
    (100 / GRAVITY, "10.2: kilogram-force centimetres and newton metres"),
    (1e5 / GRAVITY, "10.2·10³: gram-force centimetres and newton metres"),
    (1.3558179, "1.36: foot-pounds and newton metres"),
    (8.8507458, "8.85: inch-pounds and newton metres"),
    (141.61193, "142: inch-ounces and newton metres"),
    (2.0, "2: diameter and radius, or a second fall of the cable"),
)
_UNITS = {
    "angle": (*_COMMON, *_OF_ANGLES),
    "torque": (*_COMMON, *_OF_TORQUES),
    "": (*_COMMON, *_OF_ANGLES, *_OF_LOADS),
}
"""Constants by which a channel may be wrong: an angle and its speed are in no unit of a force or a
length, a torque in units of torque only; ``""`` is any other channel, as a length is by an angle.
"""


def known_factors(dimension: str = "") -> tuple[float, ...]:
    """Known constants of a channel's dimension and their reciprocals."""
    known = _UNITS.get(dimension, _UNITS[""])
    return tuple(factor for value, _ in known for factor in (value, 1 / value))


@dataclass(frozen=True)
class Slope:
    """Measured over predicted, with its standard deviation."""

    value: float
    std: float
    explained: float = 1.0
    """Share of the measured square that the fit of the slope explains."""


def named_factor(slope: Slope, dimension: str = "") -> str:
    """Known constants that the size of a slope, or its reciprocal, may be; else empty.

    They are the nearest within three standard deviations and 5 %, and those that three standard
    deviations do not exclude either; ``dimension`` is ``angle``, ``torque``, or any other.
    """
    size = abs(slope.value)
    if size == 0:
        return ""
    uncertainty = _SIGMAS * slope.std / size
    known = _UNITS.get(dimension, _UNITS[""])
    distances = sorted((abs(abs(log(size)) - abs(log(value))), text) for value, text in known)
    nearest = distances[0][0]
    if nearest >= uncertainty + _TOLERANCE:
        return ""
    limit = max(nearest, uncertainty)
    return ", or ".join(text for distance, text in distances if distance <= limit)


def slope_text(slope: Slope) -> str:
    """``−0.98 ± 0.02``: the uncertainty with one digit, the value as far."""
    digits = 2 if slope.std <= 0 else min(9, max(0, -floor(log10(slope.std))))
    if abs(slope.value) >= _LARGE:
        return f"{slope.value:.4g} ± {slope.std:.1g}".replace("-", "−")
    return f"{slope.value:.{digits}f} ± {slope.std:.{digits}f}".replace("-", "−")
