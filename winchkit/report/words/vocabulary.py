"""The words of a report: what an effect means to its owner, and what channels are called."""

from __future__ import annotations

from math import isfinite

from winchkit.diagnosis.results import Estimate
from winchkit.report.words.numbers import between, with_std

__all__ = [
    "OUTPUT_NAMES",
    "VARIABLE_NAMES",
    "VERDICT_NAMES",
    "clause",
    "estimate_text",
    "interval_text",
    "kind",
    "listed",
    "meaning",
    "parameter_name",
    "parameter_unit",
]

VERDICT_NAMES = {
    "adequate": "Adequate",
    "explained": "Explained",
    "partly": "Partly explained",
    "unknown": "Unknown",
}
OUTPUT_NAMES = {
    "cable_length": "cable length",
    "tension": "tension",
    "motor_torque": "motor torque",
    "platform_position": "platform position",
}
VARIABLE_NAMES = {
    "drum_angle": "drum angle",
    "motor_angle": "motor angle",
    "speed": "speed",
    "direction": "direction",
    "cable_length": "free length",
    "directed_length": "free length and direction",
    "load": "load",
    "tension": "tension",
    "temperature": "temperature",
    "time": "time",
    "reversal_distance": "distance since reversal",
    "winch": "line",
    "pose": "pose",
    "number": "number of the pose",
    "platform_x": "platform's x",
    "platform_y": "platform's y",
    "platform_z": "platform's z",
    "platform_roll": "platform's roll",
    "platform_pitch": "platform's pitch",
    "platform_yaw": "platform's yaw",
}
_CLAUSES = {
    "anchor-point": "your rope meets the platform elsewhere",
    "cable-creep": "your rope creeps under load",
    "cable-elongation-exponential": "your rope stretches, and stiffens with its tension",
    "cable-elongation-linear": "your rope stretches",
    "cable-elongation-quartic": "your rope stretches along a curve",
    "cable-hysteresis": "your rope stretches differently when loaded and unloaded",
    "cable-sag": "your rope sags under its own weight",
    "cable-thermal": "your rope expands with its temperature",
    "cable-weight": "your rope's own weight counts",
    "cell-creep": "your load cell creeps",
    "cell-drift": "your load cell's zero drifts with time",
    "cell-gain": "your load cell's span is wrong",
    "cell-hysteresis": "your load cell reads differently when loaded and unloaded",
    "cell-lag": "your load cell's reading comes late",
    "cell-nonlinearity": "your load cell's sensitivity changes with the load",
    "cell-offset": "your load cell's zero is off",
    "cell-thermal": "your load cell's zero follows the temperature",
    "drum-eccentricity": "your drum runs out of true",
    "drum-radius": "your drum's winding radius is off",
    "exit-point": "your rope leaves the frame elsewhere",
    "home-length": "your rope had another length at home",
    "payload-centre": "your platform's centre of mass lies elsewhere",
    "payload-mass": "your platform's mass is off",
    "swivel-radius": "your swivel pulley's radius is off",
    "drum-winding-tension": "your rope lies on the drum with the strain of its winding",
    "encoder-slip": "your drum slipped against its encoder",
    "frame-compliance": "your frame gives way to the load",
    "gear-backlash": "your gearbox has play",
    "gear-efficiency": "your gearbox loses torque to friction",
    "gear-ratio": "your gear ratio is off",
    "gear-transmission-error": "your gearbox leads and lags within each turn",
    "guide-offset": "your guide is mounted off",
    "layer-thickness": "your rope's layers grow by another amount",
    "length-time-offset": "your length instrument is late",
    "motor-cogging": "your motor cogs",
    "motor-coulomb": "your motor side rubs",
    "motor-coulomb-asymmetry": "your torque signal has an offset",
    "motor-stribeck": "your motor side rubs more at creep speed",
    "motor-viscous": "your motor side drags with speed",
    "motor-viscous-asymmetry": "your motor side drags more one way than the other",
    "pulley-capstan": "your rope drags around a stuck pulley",
    "pulley-coulomb": "your pulleys rub",
    "pulley-dahl": "your pulleys give before they slide",
    "pulley-inertia": "your pulleys' inertia counts",
    "pulley-stribeck": "your pulleys rub more at creep speed",
    "pulley-viscous": "your pulleys drag with speed",
    "rotor-inertia": "your rotor's inertia counts",
    "torque-constant": "your drive's torque constant is off",
    "torque-lag": "your drive's torque signal comes late",
    "torque-lead": "your torque signal is what the drive was told",
}
_SYMBOLS = {"axial_stiffness": "EA"}
_SHARES = ("gain_error", "ratio_error", "efficiency", "fraction")


def clause(effect: str) -> str:
    """What an effect means, in lower case; an effect that is not winchkit's keeps its id."""
    return meaning(effect) or f"the effect {effect} is missing"


def meaning(effect: str) -> str:
    """What an effect of winchkit's own means, and on which line; empty for any other."""
    own, _, line = effect.partition("/")
    words = _CLAUSES.get(own, "")
    return f"{words} (line {line})" if words and line else words


def kind(effect: str) -> str:
    """What an effect shares with its variants: that a rope stretches, by whichever law."""
    words = clause(effect)
    return min((c for c in (*_CLAUSES.values(), words) if words.startswith(c)), key=len)


def parameter_name(parameter: str) -> str:
    """A parameter's name to read: its symbol, else its words."""
    return _SYMBOLS.get(parameter, parameter.replace("_", " "))


def parameter_unit(parameter: str, unit: str) -> str:
    """The unit to read a parameter in: shares in per cent, everything else in its own."""
    return "%" if unit == "1" and parameter in _SHARES else unit


def estimate_text(parameter: str, estimate: Estimate) -> str:
    """A parameter with its value: ``EA = 247.4 ± 6.1 kN``; a whole number stays one."""
    unit = parameter_unit(parameter, estimate.unit)
    if parameter == "order":
        return f"order {estimate.value:.0f}"
    return f"{parameter_name(parameter)} = {with_std(estimate.value, estimate.std, unit)}"


def interval_text(parameter: str, estimate: Estimate) -> str:
    """``95 %: 236 to 259 kN``; empty where it was not worked out."""
    if estimate.interval is None or not all(isfinite(end) for end in estimate.interval):
        return ""
    unit = parameter_unit(parameter, estimate.unit)
    return f"95 %: {between(*estimate.interval, unit)}"


def listed(words: list[str], last: str = "and") -> str:
    """``a, b and c``."""
    if len(words) < 2:
        return "".join(words)
    return f"{', '.join(words[:-1])} {last} {words[-1]}"
