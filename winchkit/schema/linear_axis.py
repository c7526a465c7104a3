"""Names and units of a linear axis: position, velocity and force in place of angle and torque.

The model is that of a rotary axis with 1 m for 1 rad, so that 1 N stands for 1 N m and 1 kg for
1 kg m². Runs, effects and results of a linear axis have these names and units.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from winchkit.quantity_text import quantity

CHANNELS: Mapping[str, str] = {
    "motor_angle": "position",
    "motor_velocity": "velocity",
    "motor_torque": "force",
    "predicted_torque": "predicted_force",
}
"""Channel of a linear axis by that of a rotary one."""
ROTARY: Mapping[str, str] = {linear: rotary for rotary, linear in CHANNELS.items()}
"""Channel of a rotary axis by that of a linear one."""
PARAMETERS: Mapping[str, str] = {"torque": "force", "inertia": "mass"}
"""Parameter of an effect on a linear axis by that on a rotary one."""
UNITS: Mapping[str, str] = {
    "rad": "m",
    "rad/s": "m/s",
    "rad/s^2": "m/s^2",
    "N m": "N",
    "N m s": "N s/m",
    "N m/s": "N/s",
    "N m/rad": "N/m",
    "N m/A": "N/A",
    "kg m^2": "kg",
    "mN m": "mN",
    "kN m": "kN",
}
"""SI unit on a linear axis by that on a rotary one."""

_WORDS: tuple[tuple[re.Pattern[str], str], ...] = tuple(
    (re.compile(pattern), word)
    for pattern, word in (
        (r"\binertia on the motor side\b", "moved mass"),
        (r"\bmotor side\b", "axis"),
        (r"\b(?:motor|drum)(?:_| )angle\b", "position"),
        (r"\bmotor(?:_| )velocity\b", "velocity"),
        (r"\bmotor(?:_| )torque\b", "force"),
        (r"(?<![-\w])torque\b(?![-\w=])", "force"),
        (r"(?<=\d )(µ|m|k|)N m s\b", r"\1N s/m"),
        (r"(?<=\d )(µ|m|k|)N m\b(?!/)", r"\1N"),
        (r"(?<=\[)N m(?=\])", "N"),
        (r"\b(\d+(?:\.\d+)?) (µ|m|)rad\b", r"\1 \2m"),
        (r"(?<=\[)rad\b", "m"),
        (r"\brad/s\b", "m/s"),
        (r"\bwithin a motor turn\b", "within a short distance"),
    )
)
_PERIODS = re.compile(r"(\d+) periods? per (?:motor|drum) turn")


def linear_words(text: str) -> str:
    """A text, a channel or a unit of a rotary axis as that of a linear one."""
    if text in UNITS:
        return UNITS[text]
    for pattern, word in _WORDS:
        text = pattern.sub(word, text)
    return _PERIODS.sub(lambda found: _period(int(found[1])), text)


def rotary_name(name: str) -> str:
    """The channel, output or variable of the model that a result on a linear axis names."""
    return ROTARY.get(name, name)


def _period(order: int) -> str:
    return f"a period of {quantity(2 * math.pi / order, 'm')}"
