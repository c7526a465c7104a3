"""Names of outputs and variables, and a clause for every effect, as reports print them."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite

from winchkit.diagnosis.results import Combination, Estimate, series_orders
from winchkit.effects.series import fundamentals
from winchkit.quantity_text import between, with_std

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
_CLAUSES = {
    "anchor-point": "the anchor point of the cable differs from the profile",
    "cable-creep": "the cable creeps under load",
    "cable-elongation-exponential": "the cable is elastic and stiffens with its tension",
    "cable-elongation-linear": "the cable is elastic",
    "cable-elongation-quartic": "the cable is elastic with a nonlinear law",
    "cable-hysteresis": "the cable is elastic with hysteresis",
    "cable-sag": "the cable sags under its own weight",
    "cable-thermal": "the cable expands with its temperature",
    "cable-weight": "the weight of the cable is not negligible",
    "cell-clipping": "the reading of the load cell saturates",
    "cell-creep": "the load cell creeps",
    "cell-crosstalk": "the load cell reads a share of the motor torque",
    "cell-drift": "the zero of the load cell drifts with time",
    "cell-gain": "the span of the load cell is wrong",
    "cell-hysteresis": "the load cell has hysteresis",
    "cell-lag": "the reading of the load cell is delayed",
    "cell-nonlinearity": "the sensitivity of the load cell depends on the load",
    "cell-offset": "the zero of the load cell is wrong",
    "cell-thermal": "the zero of the load cell depends on the temperature",
    "drum-eccentricity": "the drum has runout",
    "drum-unbalance": "the drum is unbalanced",
    "drum-radius": "the winding radius of the drum is wrong",
    "exit-point": "the exit point of the cable differs from the profile",
    "home-length": "the cable length at home differs from the profile",
    "tracker-delay": "the tracker is delayed against the bench",
    "imu-mounting": "the axes of the target or IMU are turned on the platform",
    "payload-centre": "the centre of mass of the platform is wrong",
    "payload-mass": "the mass of the platform is wrong",
    "swivel-radius": "the radius of the swivel pulley is wrong",
    "drum-winding-tension": "the cable on the drum keeps the strain of its winding",
    "encoder-slip": "the drum slipped against its encoder",
    "friction-at-place": "the motor side has more friction at one position",
    "friction-of-load": "the motor side has friction in proportion to the load",
    "friction-of-torque": "the motor side has friction in proportion to the motor torque",
    "friction-growth": "the Coulomb friction of the motor side changes with time",
    "frame-compliance": "the frame is compliant",
    "gear-backlash": "the gearbox has backlash",
    "gear-dahl": "the gearbox has presliding friction in proportion to the load (Dahl)",
    "gear-efficiency": "the gearbox loses torque by friction",
    "gear-ratio": "the gear ratio is wrong",
    "gear-transmission-error": "the gearbox has a periodic transmission error",
    "guide-offset": "the guide is mounted with an offset",
    "joint-gravity": "the axis carries an eccentric weight",
    "layer-thickness": "the growth of the cable layers is wrong",
    "length-time-offset": "the length instrument is delayed",
    "load-lever": "the load acts through a lever",
    "motor-cogging": "the motor has cogging torque",
    "motor-coulomb": "the motor side has Coulomb friction",
    "motor-coulomb-asymmetry": "the torque signal has an offset",
    "motor-dahl": "the motor side has presliding friction (Dahl)",
    "motor-stribeck": "the motor side has Coulomb friction with a Stribeck curve",
    "motor-viscous": "the motor side has viscous friction",
    "motor-viscous-asymmetry": "the viscous friction of the motor side depends on the direction",
    "pulley-capstan": "the cable slides around a blocked pulley (capstan friction)",
    "pulley-coulomb": "the pulleys have Coulomb friction",
    "pulley-dahl": "the pulleys have presliding friction (Dahl)",
    "pulley-inertia": "the inertia of the pulleys is not negligible",
    "pulley-stribeck": "the pulleys have Coulomb friction with a Stribeck curve",
    "pulley-viscous": "the pulleys have viscous friction",
    "rotor-inertia": "the inertia on the motor side is not negligible",
    "spring-balancer": "the torque is linear in the position (a spring or a weight)",
    "stribeck-of-load": "the friction in proportion to the load is higher at low speed",
    "torque-constant": "the torque constant of the drive is wrong",
    "torque-lag": "the torque signal of the drive is delayed",
    "torque-ripple": "the torque constant depends on the rotor position",
    "torque-lead": "the torque signal is the command, ahead of the torque",
}
_ORDERS_SHOWN = 8
"""Amplitudes of a series in one line."""
_MAIN_ORDERS = 0.1
"""Share of the largest amplitude: smaller orders do not enter the guess of poles and slots."""
_SYMBOLS = {"axial_stiffness": "EA"}
_SHARES = ("gain_error", "ratio_error", "efficiency", "fraction")


def variable_name(variable: str) -> str:
    """Name of a variable in texts."""
    return VARIABLE_NAMES.get(variable, variable.replace("_", " "))


def clause(effect: str) -> str:
    """Clause on a missing effect, in lower case; a user effect is named by its id."""
    return meaning(effect) or f"the effect {effect} is missing"


def meaning(effect: str) -> str:
    """Clause on an effect of the catalogue, with its line; empty for a user effect."""
    own, _, line = effect.partition("/")
    words = _CLAUSES.get(own, "")
    return f"{words} (line {line})" if words and line else words


def kind(effect: str) -> str:
    """The clause that an effect shares with its variants, such as the laws of elongation."""
    words = clause(effect)
    return min((c for c in (*_CLAUSES.values(), words) if words.startswith(c)), key=len)


def parameter_name(parameter: str) -> str:
    """Name of a parameter in texts: its symbol, else its words."""
    return _SYMBOLS.get(parameter, parameter.replace("_", " "))


def parameter_unit(parameter: str, unit: str) -> str:
    """Unit of a parameter in texts: per cent for shares, else its own."""
    return "%" if unit == "1" and parameter in _SHARES else unit


def estimate_text(parameter: str, estimate: Estimate) -> str:
    """A parameter with its value: ``EA = 247.4 ± 6.1 kN``; an order is a whole number."""
    unit = parameter_unit(parameter, estimate.unit)
    if parameter == "order":
        return f"order {estimate.value:.0f}"
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
    shown = [
        f"{with_std(amplitude.value, amplitude.std, amplitude.unit)} at order {order}"
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
    unit = parameter_unit(parameter, estimate.unit)
    return f"95 %: {between(*estimate.interval, unit)}"


def listed(words: list[str], last: str = "and") -> str:
    """``a, b and c``."""
    if len(words) < 2:
        return "".join(words)
    return f"{', '.join(words[:-1])} {last} {words[-1]}"
