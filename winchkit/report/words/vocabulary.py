"""Names of outputs and variables, and a clause for every effect, as reports print them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from math import isfinite

from winchkit.diagnosis.results import Combination, Estimate, OutputFit, series_orders
from winchkit.effects.effect import parameter_name, parameter_unit
from winchkit.effects.series import fundamentals
from winchkit.quantity_text import PrintScale, between, scale_for, with_std
from winchkit.report.words.effect_names import EFFECTS

_FAR = 300.0
"""Ratio of two errors from which the smaller one has three zeros in the unit of the larger one."""
VERDICT_NAMES = {
    "adequate": "Adequate",
    "explained": "Explained",
    "partly": "Partly explained",
    "unknown": "Unknown",
    "undecided": "Undecided",
}
OUTPUT_NAMES = {
    "cable_length": "cable length",
    "tension": "tension",
    "motor_torque": "motor torque",
    "force": "force",
    "platform_position": "platform position",
}
VARIABLE_NAMES = {
    "drum_angle": "drum angle",
    "motor_angle": "motor angle",
    "position": "position",
    "speed": "speed",
    "direction": "direction",
    "cable_length": "free length",
    "directed_length": "free length and direction",
    "directed_load": "load and direction",
    "directed_tension": "tension and direction",
    "load": "load",
    "tension": "tension",
    "temperature": "temperature",
    "time": "time",
    "reversal_distance": "distance since reversal",
    "winch": "line",
    "pose": "pose",
    "number": "number of the pose",
    "platform_x": "platform x",
    "platform_y": "platform y",
    "platform_z": "platform z",
    "platform_roll": "platform roll",
    "platform_pitch": "platform pitch",
    "platform_yaw": "platform yaw",
}
_ORDERS_SHOWN = 8
"""Amplitudes of a series in one line."""
_MAIN_ORDERS = 0.1
"""Share of the largest amplitude: smaller orders do not enter the guess of poles and slots."""
_WHOLE = {"order": "order {:.0f}", "lobes": "{:.0f} lobes", "pulley": "pulley {:.0f}"}
"""Whole numbers, which have no error."""


def output_name(output: str) -> str:
    """Name of an output in texts."""
    return OUTPUT_NAMES.get(output, output)


def variable_name(variable: str) -> str:
    """Name of a variable in texts."""
    return VARIABLE_NAMES.get(variable, variable.replace("_", " "))


def error_scale(output: OutputFit) -> PrintScale:
    """One scale for all errors of an output: of the first one, or of a far smaller last one."""
    before, after = output.heldout_rms_before, output.heldout_rms_after
    return scale_for(before / _FAR if after < before / _FAR else before, output.unit)


def clause(effect: str) -> str:
    """Clause on a missing effect, in lower case; a user effect is named by its id."""
    return meaning(effect) or f"the effect {effect} is missing"


def meaning(effect: str) -> str:
    """Clause on an effect of the catalogue, with its line; empty for a user effect."""
    own, _, line = effect.partition("/")
    words = EFFECTS[own][1] if own in EFFECTS else ""
    return f"{words} (line {line})" if words and line else words


def kind(effect: str) -> str:
    """The clause that an effect shares with its variants, such as the laws of elongation."""
    words = clause(effect)
    clauses = [own for _, own in EFFECTS.values()]
    return min((c for c in (*clauses, words) if words.startswith(c)), key=len)


def effect_name(effect: str) -> str:
    """Name of an effect in lists: ``runout of the drum``; a user effect by its id in words."""
    own, _, line = effect.partition("/")
    curve = re.fullmatch(r"empirical-(cable-length|tension|motor-torque|force)-(.+)", own)
    words = EFFECTS[own][0] if own in EFFECTS else own.replace("-", " ")
    if curve is not None:
        words = f"curve of the {curve[1].replace('-', ' ')} over the {curve[2].replace('-', ' ')}"
    return f"{words} (line {line})" if line else words


def name_and_id(effect: str) -> str:
    """Name of an effect with its id for commands, such as ``gear ratio (gear-ratio)``."""
    name = effect_name(effect)
    return effect if name == effect else f"{name} ({effect})"


def estimate_text(parameter: str, estimate: Estimate) -> str:
    """A parameter with its value: ``EA = 247.4 ± 6.1 kN``."""
    unit = parameter_unit(parameter, estimate.unit)
    if parameter in _WHOLE:
        return _WHOLE[parameter].format(estimate.value)
    return f"{parameter_name(parameter)} = {with_std(estimate.value, estimate.std, unit)}"


def combination_text(combination: Combination) -> str:
    """Combination that the data determine: ``cable per motor turn = 18.7042 ± 0.0014 mm``."""
    unit = "" if combination.unit == "1" else combination.unit
    return f"{combination.name} = {with_std(combination.value, combination.std, unit)}"


def values_text(values: Mapping[str, Estimate]) -> str:
    """All parameters with their values; the orders of a harmonic series, the largest first."""
    if "order_2" not in values:
        return ", ".join(estimate_text(name, value) for name, value in values.items())
    orders = series_orders(values)
    largest = orders[0][1].value
    main = [order for order, amplitude in orders if amplitude.value >= _MAIN_ORDERS * largest]
    unit = orders[0][1].unit
    scale = scale_for(largest, unit)
    shown = [
        f"{with_std(amplitude.value, amplitude.std, unit, scale)} at order {order}"
        for order, amplitude in orders[:_ORDERS_SHOWN]
    ]
    more = len(orders) - len(shown)
    text = ", ".join(shown) + (f" and {more} more" if more else "")
    common = fundamentals(main)
    if common:
        text += f"; the main orders are multiples of {listed([str(k) for k in common])}"
        text += ", as those of pole pairs and slots are"
    return text


def interval_text(parameter: str, estimate: Estimate) -> str:
    """``95 %: 236 to 259 kN``; empty where it was not computed."""
    if estimate.interval is None or not all(isfinite(end) for end in estimate.interval):
        return ""
    if parameter in _WHOLE:
        return ""
    unit = parameter_unit(parameter, estimate.unit)
    scale = scale_for((estimate.value, estimate.std), unit)
    return f"95 %: {between(*estimate.interval, unit, scale)}"


def runs_listed(names: Sequence[str], most: int) -> str:
    """``a, b``; of more than ``most`` runs ``12 runs, a to l``."""
    if len(names) <= most:
        return ", ".join(names)
    return f"{len(names)} runs, {names[0]} to {names[-1]}"


def listed(words: list[str], last: str = "and") -> str:
    """``a, b and c``."""
    if len(words) < 2:
        return "".join(words)
    return f"{', '.join(words[:-1])} {last} {words[-1]}"
