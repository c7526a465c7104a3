"""A residual map in words."""

from __future__ import annotations

import numpy as np

from winchkit.diagnosis.maps import ResidualMap
from winchkit.diagnosis.report.axes import Reading, reading
from winchkit.diagnosis.report.phrases import VARIABLE_NAMES
from winchkit.diagnosis.report.wording import Scale, percent
from winchkit.model.variables import ANGLES

__all__ = ["map_reading", "map_text", "signed"]


def map_text(drawn: ResidualMap, scale: Scale) -> str:
    """``over free length and load 93 %, most +1.2 mm at 3 m, 196 N``."""
    across, up = drawn.largest
    mean = float(drawn.mean[across, up])
    places = [
        _place(map_reading(name), float(np.mean(edges[at : at + 2])))
        for name, edges, at in zip(drawn.over, drawn.edges, (across, up), strict=True)
    ]
    names = " and ".join(_name(name) for name in drawn.over)
    share = percent(drawn.share)
    return f"over {names} {share}, most {signed(mean, scale)} at {', '.join(places)}"


def map_reading(variable: str) -> Reading:
    """How a map's variable is written: an angle within its turn."""
    return reading(variable, within_turn=variable in ANGLES)


def _name(variable: str) -> str:
    return VARIABLE_NAMES.get(variable, variable.replace("_", " "))


def _place(how: Reading, value: float) -> str:
    return Scale(how.unit, 1.0).text(float(how.shown(value)), 2)


def signed(value: float, scale: Scale) -> str:
    """A value with its sign: ``+1.2 mm``."""
    text = scale.text(value, 2)
    return f"+{text}" if value > 0 else text
