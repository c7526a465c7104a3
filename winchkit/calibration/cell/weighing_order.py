"""Loading sequence of a calibration: increasing and decreasing, several series."""

from __future__ import annotations

import re
from math import nan

from winchkit.errors import UsageError
from winchkit.schema.calibration import CalibrationPoint
from winchkit.units import GRAVITY, UNITS, convert

_WEIGHTS = re.compile(r"([\d.,;\s]+?)\s*([a-zA-Z]+)")


def plan(weights: str, series: int) -> tuple[CalibrationPoint, ...]:
    """Points to measure for weights such as ``"0 2 5 10 kg"``.

    ``weights``: increasing numbers and a unit of mass or force. Returns: increasing, then
    decreasing without repeating the largest load. Raises UsageError for weights that are not a list
    of increasing numbers with a unit.
    """
    found = _WEIGHTS.fullmatch(weights.strip())
    if found is None:
        raise UsageError(f"'{weights}' is no list of weights; write such as \"0 2 5 10 kg\"")
    try:
        numbers = [float(word) for word in re.split(r"[,;\s]+", found[1].strip())]
    except ValueError:
        raise UsageError(f"'{weights}' contains a text that is not a number") from None
    loads = [_force(number, found[2]) for number in numbers]
    if sorted(set(loads)) != loads:
        raise UsageError(f"'{weights}' must rise from one weight to the next; they are hung so")
    if series < 1:
        raise UsageError(f"{series} series; at least one is needed, three are usual")
    down = loads[-2::-1]
    points = []
    for number in range(1, series + 1):
        up = loads if number == 1 else loads[1:]
        points += [CalibrationPoint(load, nan, 0.0, "up", number) for load in up]
        points += [CalibrationPoint(load, nan, 0.0, "down", number) for load in down]
    return tuple(points)


def spoken(point: CalibrationPoint) -> str:
    """``5 kg (49.03 N, going up, series 1)``."""
    return (
        f"{point.load / GRAVITY:.4g} kg ({point.load:.4g} N, going {point.going}, "
        f"series {point.series})"
    )


def _force(value: float, unit: str) -> float:
    if unit in UNITS["mass"]:
        return convert(value, unit, "mass") * GRAVITY
    if unit in UNITS["force"]:
        return convert(value, unit, "force")
    raise UsageError(f"weights in '{unit}'; use kg, g, t or N, kN")
