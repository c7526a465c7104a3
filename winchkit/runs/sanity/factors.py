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

_UNITS: tuple[tuple[float, str], ...] = (
    *((10.0**n, f"10^{n}, a power of ten (milli, percent, kilo …)") for n in (1, 2, 3, 4, 5, 6, 9)),
    (2 * pi, "2π: radians and turns"),
    (180 / pi, "180/π: degrees and radians"),
    (360.0, "360: degrees and turns"),
    (60.0, "60: per minute and per second"),
    (60 / (2 * pi), "60/(2π): rpm and rad/s"),
    (6.0, "6: rpm and deg/s"),
    (pi, "π: circumference and diameter"),
    *((2.0**n, f"2^{n}: counts") for n in range(_FEWEST_BITS, _MOST_BITS + 1)),
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
    (8.8507458, "8.85: inch-pounds and newton metres"),
    (2.0, "2: diameter and radius, or a second fall of the cable"),
)
"""Constants of masses, forces and lengths, which no angle or angular speed is wrong by."""

KNOWN_FACTORS: tuple[float, ...] = tuple(
    factor for value, _ in (*_UNITS, *_OF_LOADS) for factor in (value, 1 / value)
)
"""Known constants and their reciprocals."""


@dataclass(frozen=True)
class Slope:
    """Measured over predicted, with its standard deviation."""

    value: float
    std: float
    explained: float = 1.0
    """Share of the measured square that the fit of the slope explains."""


def named_factor(slope: Slope, *, is_angle: bool = False) -> str:
    """Known constants that the size of a slope, or its reciprocal, may be; else empty.

    They are the nearest within three standard deviations and 5 %, and those that three standard
    deviations do not exclude either. An angle (``is_angle``) is in no unit of force or length.
    """
    size = abs(slope.value)
    if size == 0:
        return ""
    uncertainty = _SIGMAS * slope.std / size
    known = _UNITS if is_angle else (*_UNITS, *_OF_LOADS)
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
