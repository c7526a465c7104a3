"""Unit strings to SI floats and back: ``parse("60 mm", "length") == 0.06``.

A dimension is a name (``"length"``) with a table of units; the first unit of a table is the
SI one. There are two exceptions: temperatures are in degrees Celsius and their drifts per hour.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

from winchkit.errors import UsageError, suggest

GRAVITY = 9.80665
"""Standard acceleration of gravity, m/s² (3rd CGPM, 1901; exact)."""
_TURN = 2 * math.pi
_DEG = math.pi / 180

UNITS: dict[str, dict[str, float]] = {
    "length": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "km": 1e3},
    "speed": {"m/s": 1.0, "mm/s": 1e-3, "cm/s": 1e-2, "m/min": 1 / 60},
    "acceleration": {"m/s^2": 1.0, "mm/s^2": 1e-3},
    "jerk": {"m/s^3": 1.0, "mm/s^3": 1e-3},
    "angle": {"rad": 1.0, "deg": _DEG, "turn": _TURN, "mrad": 1e-3},
    "angular speed": {"rad/s": 1.0, "deg/s": _DEG, "rpm": _TURN / 60, "turn/s": _TURN},
    "angular acceleration": {"rad/s^2": 1.0, "deg/s^2": _DEG},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0},
    "gain": {"1/s": 1.0},
    "frequency": {"Hz": 1.0, "kHz": 1e3},
    "force": {"N": 1.0, "kN": 1e3, "mN": 1e-3, "daN": 10.0, "MN": 1e6},
    "torque": {"N m": 1.0, "mN m": 1e-3, "N mm": 1e-3, "kN m": 1e3},
    "mass": {"kg": 1.0, "g": 1e-3, "t": 1e3},
    "mass per length": {"kg/m": 1.0, "g/m": 1e-3},
    "inertia": {"kg m^2": 1.0, "kg cm^2": 1e-4, "g cm^2": 1e-7},
    "stiffness": {"N/m": 1.0, "N/mm": 1e3, "kN/m": 1e3, "kN/mm": 1e6},
    "viscosity": {"N s/m": 1.0, "kN s/m": 1e3},
    "rotational viscosity": {"N m s": 1.0, "mN m s": 1e-3},
    "force per time": {"N/s": 1.0, "N/min": 1 / 60, "N/h": 1 / 3600},
    "torque per time": {"N m/s": 1.0, "mN m/s": 1e-3, "N m/h": 1 / 3600},
    "rotational stiffness": {"N m/rad": 1.0, "mN m/rad": 1e-3, "N m/deg": 1 / _DEG},
    "force per torque": {"N/(N m)": 1.0},
    "torque per current": {"N m/A": 1.0, "mN m/A": 1e-3},
    "force per current": {"N/A": 1.0, "mN/A": 1e-3},
    "angular frequency": {"rad/m": 1.0, "rad/mm": 1e3},
    "force per temperature": {"N/K": 1.0, "mN/K": 1e-3},
    "expansion": {"1/K": 1.0, "1/degC": 1.0},
    "torque constant": {"N m/A": 1.0, "mN m/A": 1e-3},
    "current": {"A": 1.0, "mA": 1e-3},
    "voltage": {"V": 1.0, "mV": 1e-3},
    "power": {"W": 1.0, "kW": 1e3},
    "pressure": {"Pa": 1.0, "MPa": 1e6, "GPa": 1e9},
    "temperature": {"degC": 1.0, "K": 1.0},
    "temperature difference": {"K": 1.0, "degC": 1.0},
    "temperature drift": {"K/h": 1.0, "K/min": 60.0, "K/s": 3600.0},
    "ratio": {"1": 1.0, "%": 1e-2, "ppm": 1e-6},
    "number": {"1": 1.0},
    "number per second": {"1": 1.0},
}
_QUANTITY = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?inf)\s*(.*)", re.ASCII)
_SPELLED = str.maketrans(
    {"µ": "u", "μ": "u", "°": "deg", "²": "^2", "³": "^3", "·": " ", "*": " ", "⋅": " "}
)
"""As units are printed and written elsewhere."""
_SAME_UNITS = {"1/min": "rpm", "U/min": "rpm", "rev": "turn", "sec": "s"}
_ZERO_CELSIUS = 273.15
"""K (exact by the definition of the degree Celsius)."""


def article(noun: str) -> str:
    """``an angle``, ``a length``."""
    return f"an {noun}" if noun[0] in "aeiou" else f"a {noun}"


def dimension_of(unit: str) -> str | None:
    """Name the dimension of a unit string, or None where it is unknown."""
    return next((name for name, table in UNITS.items() if unit in table), None)


def own_spelling(unit: str, table: Iterable[str]) -> str:
    """The table's spelling of a unit: ``um`` of ``µm``, ``N m`` of ``Nm``; others unchanged."""
    if unit in table:
        return unit
    plain = _SAME_UNITS.get(unit, unit.translate(_SPELLED))
    joined = {own.replace(" ", ""): own for own in table}
    return joined.get(plain.replace(" ", ""), plain) if " " not in unit else plain


def factor(unit: str, dimension: str) -> float:
    """SI value of one ``unit``; raises UsageError with the valid units."""
    table = UNITS[dimension]
    own = own_spelling(unit, table)
    if own in table:
        return table[own]
    other = dimension_of(own)
    if other is None:
        fault = f"unknown{'' if is_bare(dimension) else f' {dimension}'} unit '{unit}'"
    else:
        fault = f"'{unit}' is a unit of {other}"
        fault += "" if is_bare(dimension) else f", not of {dimension}"
    raise UsageError(f"{fault}; {_written(dimension)}" + suggest(unit, list(table)))


def is_bare(dimension: str) -> bool:
    """Whether values of a dimension may be written without a unit."""
    return "1" in UNITS[dimension]


def _written(dimension: str) -> str:
    """What to write for a value of a dimension."""
    units = ", ".join(unit for unit in UNITS[dimension] if unit != "1")
    if not is_bare(dimension):
        return f"use one of {units}"
    return f"write {article(dimension)} without a unit" + (f", or in {units}" if units else "")


def convert(value: float, unit: str, dimension: str) -> float:
    """Convert ``value`` from ``unit`` to SI (degrees Celsius for a temperature)."""
    shift = -_ZERO_CELSIUS if unit == "K" and dimension == "temperature" else 0.0
    return value * factor(unit, dimension) + shift


def number_and_unit(text: str) -> tuple[float, str] | None:
    """Split ``"60 mm"`` or ``"60mm"``, the unit may be empty; None for no number at the start."""
    found = _QUANTITY.fullmatch(text.strip())
    return (float(found[1]), found[2]) if found else None


def parse(text: object, dimension: str) -> float:
    """Read ``"60 mm"`` as an SI float; a bare number is refused unless it has no dimension."""
    if isinstance(text, int | float) and not isinstance(text, bool):
        if is_bare(dimension):
            return float(text)
        raise UsageError(f'{text} has no unit; write "{text} UNIT" ({_written(dimension)})')
    with_unit = "" if is_bare(dimension) else " with its unit"
    if not isinstance(text, str):
        raise UsageError(f"expected {article(dimension)}{with_unit}, not {type(text).__name__}")
    found = number_and_unit(text)
    if found is None or found[1].startswith((",", ":")):
        hint = "; write a ratio as one number, such as 20" if ":" in text else point_hint(text)
        raise UsageError(f"'{text}' is not a number{with_unit}{hint}")
    value, unit = found
    if not unit and not is_bare(dimension):
        raise UsageError(f"'{text}' has no unit; {_written(dimension)}")
    return convert(value, unit or "1", dimension)


def point_hint(text: str) -> str:
    """``; write the decimal point: 0.5 m`` for a number with a decimal comma, else nothing."""
    is_comma = "," in text and "." not in text
    return f"; write the decimal point: {text.replace(',', '.')}" if is_comma else ""


def format_quantity(value: float, unit: str, digits: int = 6) -> str:
    """Write an SI value in ``unit``, e.g. ``format_quantity(0.06, "mm") == "60 mm"``."""
    dimension = dimension_of(unit)
    if dimension is None:
        raise UsageError(f"unknown unit '{unit}'")
    number = f"{value / UNITS[dimension][unit]:.{digits}g}"
    return number if unit == "1" else f"{number} {unit}"
