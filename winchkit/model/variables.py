"""Variables along a run to which a residual may be attributed, by their names in reports."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from winchkit.arrays import Array
from winchkit.model.recurrence import play
from winchkit.model.stages import At

_CREEP_SPEED = 1e-4
"""m/s: a slower cable has no direction; above the noise of a differentiated encoder, far below the
slowest motion (1 mm/s)."""
_CREEP_LENGTH = 1e-4
"""m: half the play that suppresses reversals by encoder noise at standstill."""


def _direction(at: At) -> Array:
    return np.sign(np.where(np.abs(at.speed) > _CREEP_SPEED, at.speed, 0.0))


def _reversal_distance(at: At) -> Array:
    """Logarithm (base 10) of the distance run since the last change of direction, m."""
    length = at.free_length
    # A backlash of twice the creep length suppresses reversals by encoder noise at standstill.
    moved = np.diff(play(length, 2 * _CREEP_LENGTH), prepend=length[:1])
    index = np.arange(len(moved))
    sign = np.sign(moved)
    held = sign[np.maximum.accumulate(np.where(sign != 0, index, 0))]
    turned = np.maximum.accumulate(np.where(np.diff(held, prepend=held[:1]) != 0, index, 0))
    travelled = np.cumsum(np.abs(moved))
    return np.asarray(np.log10(np.maximum(travelled - travelled[turned], 1e-5)))


VARIABLES: Mapping[str, Callable[[At], Array]] = {
    "drum_angle": lambda at: at.drum_angle,
    "motor_angle": lambda at: at.motor_angle,
    "speed": lambda at: at.speed,
    "direction": _direction,
    "cable_length": lambda at: at.free_length,
    "directed_length": lambda at: at.free_length * _direction(at),
    "time": lambda at: at.time,
    "reversal_distance": _reversal_distance,
    "load": lambda at: at.tension,
    "tension": lambda at: at.tension,
    "directed_load": lambda at: at.tension * _direction(at),
    "directed_tension": lambda at: at.tension * _direction(at),
    "temperature": lambda at: at.temperature,
}
"""Arrays (n,) along a run; ``load`` and ``tension`` are the cable force, whichever is known.

``directed_load`` and ``directed_tension`` are that force while winding in, its negative while
paying out, and zero at rest: friction in proportion to the load is a line over it.
``directed_length`` is the free length with the same sign: friction at one position of the stroke
is a curve over it.
"""

VARIABLE_UNITS: Mapping[str, str] = {
    "drum_angle": "rad",
    "motor_angle": "rad",
    "position": "m",
    "speed": "m/s",
    "direction": "1",
    "cable_length": "m",
    "directed_length": "m",
    "time": "s",
    "reversal_distance": "1",
    "load": "N",
    "tension": "N",
    "directed_load": "N",
    "directed_tension": "N",
    "temperature": "degC",
}
ANGLES = ("drum_angle", "motor_angle")
"""Variables with a period of one turn."""
COMPOUND: Mapping[str, tuple[str, ...]] = {
    "directed_length": ("cable_length", "direction"),
    "directed_load": ("load", "direction"),
    "directed_tension": ("tension", "direction"),
}
"""Products of two variables, with both of them."""
