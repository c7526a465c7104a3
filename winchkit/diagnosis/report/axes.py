"""A variable along an axis as people read it: an angle in turns or degrees, the rest in SI."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from winchkit.diagnosis.report.phrases import VARIABLE_NAMES
from winchkit.model.variables import ANGLES, VARIABLE_UNITS

__all__ = ["Reading", "reading"]

_Value = TypeVar("_Value", float, NDArray[np.float64])
_TURN = 2 * np.pi
_DEGREES = 360.0
_OF_PLATFORM = {f"platform_{axis}": ("m", 1.0) for axis in "xyz"} | {
    f"platform_{angle}": ("°", _TURN / _DEGREES) for angle in ("roll", "pitch", "yaw")
}


@dataclass(frozen=True)
class Reading:
    """How a variable is written on an axis."""

    label: str
    """Its name with the unit."""
    unit: str
    worth: float = 1.0
    """SI value of one of it."""
    logarithmic: bool = False
    """The variable is a logarithm (base 10) of what is shown."""

    def shown(self, values: _Value) -> _Value:
        """SI values as they are shown."""
        return 10.0**values if self.logarithmic else values / self.worth


_WITH_A_SIGN = {
    "direction": Reading("direction (1 winds in, −1 pays out)", ""),
    "directed_length": Reading("free length, winding in; negative: paying out [m]", "m"),
}


def reading(variable: str, *, within_turn: bool = False) -> Reading:
    """How to write a variable; an angle within its turn in degrees, else in turns."""
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
