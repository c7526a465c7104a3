"""Shapes of hidden effects, drawn at random, and their values at a given size."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi

import numpy as np

from campaign.winch import Winch

__all__ = ["CATALOGUE", "OUTSIDE", "Scene", "allowed", "draw"]

Random = np.random.Generator
Values = dict[str, float]
Sized = Callable[[float], Values]

LENGTH = (
    "drum-radius", "gear-ratio", "layer-thickness", "drum-eccentricity", "gear-backlash",
    "gear-transmission-error", "encoder-slip", "guide-offset", "cable-elongation-linear",
    "cable-elongation-quartic", "cable-elongation-exponential", "cable-hysteresis", "cable-creep",
    "cable-thermal", "cable-sag", "drum-winding-tension", "frame-compliance",
    "length-time-offset",
)  # fmt: skip
TENSION = (
    "pulley-coulomb", "pulley-viscous", "pulley-stribeck", "pulley-dahl", "pulley-capstan",
    "pulley-inertia", "cable-weight", "cell-gain", "cell-offset", "cell-nonlinearity",
    "cell-drift", "cell-thermal", "cell-lag", "cell-hysteresis", "cell-creep",
)  # fmt: skip
TORQUE = (
    "torque-constant", "gear-efficiency", "motor-coulomb", "motor-coulomb-asymmetry",
    "motor-viscous", "motor-stribeck", "motor-cogging", "rotor-inertia", "torque-lag",
)  # fmt: skip
CATALOGUE = LENGTH + TENSION + TORQUE
OUTSIDE = (
    "outside-harmonic", "outside-crosstalk", "outside-shaken-length", "outside-sticky-place",
    "outside-mis-spooling", "outside-joint", "outside-wander", "outside-clipping",
    "outside-platform", "outside-square-drag",
)  # fmt: skip


def allowed(effect: str, winch: Winch, load_known: bool, warms: bool, loads: int) -> bool:
    """Whether an effect can act, and show, on a winch and its channels."""
    if effect.startswith("gear-") and effect != "gear-efficiency" and winch.ratio == 1:
        return False
    if effect == "outside-harmonic":
        return abs(5 / winch.ratio - round(5 / winch.ratio)) > 0.02
    needs = {
        "layer-thickness": winch.kind in {"spiral", "archimedean"},
        "guide-offset": winch.guide_distance > 0,
        "cable-sag": winch.inclination < 70,
        "cable-weight": winch.inclination > 20 and load_known,
        "cable-thermal": warms,
        "cell-thermal": warms and load_known,
        "outside-clipping": load_known,
        "outside-joint": loads > 2,
        "outside-sticky-place": load_known,
        "outside-square-drag": load_known,
    }
    if effect.startswith("pulley-"):
        return bool(winch.wraps) and load_known
    return needs.get(effect, load_known or effect not in TENSION)


def draw(effect: str, random: Random, winch: Winch, scene: Scene) -> Sized:
    """Values of an effect as a function of its size; one is a typical size."""
    one = _ONE.get(effect)
    if one is not None:
        name, typical, either_sign = one
        sign = random.choice([-1.0, 1.0]) if either_sign else 1.0
        return lambda size: {name: sign * typical * size}
    soft = _SOFT.get(effect)
    if soft is not None:
        name, typical = soft
        return lambda size: {name: typical / size}
    return _shaped(effect, random, winch, scene)


@dataclass(frozen=True)
class Scene:
    """What sizes depend on: SI."""

    seconds: float
    stroke: float
    masses: tuple[float, ...]


_ONE = {
    "drum-radius": ("radius_error", 5e-4, True),
    "gear-ratio": ("ratio_error", 5e-3, True),
    "layer-thickness": ("thickness_error", 1e-4, True),
    "cable-thermal": ("expansion", 1.1e-5, True),
    "cable-sag": ("mass_per_length", 0.14, False),
    "drum-winding-tension": ("fraction", 5e-3, False),
    "length-time-offset": ("delay", 0.02, False),
    "pulley-coulomb": ("friction", 0.02, False),
    "pulley-viscous": ("viscosity", 10.0, False),
    "pulley-capstan": ("friction", 0.02, False),
    "pulley-inertia": ("equivalent_mass", 0.5, False),
    "cable-weight": ("mass_per_length", 0.14, False),
    "cell-gain": ("gain_error", 0.01, True),
    "cell-offset": ("offset", 5.0, True),
    "cell-nonlinearity": ("quadratic", 5.0, True),
    "cell-drift": ("drift", 0.02, True),
    "cell-thermal": ("sensitivity", 0.5, True),
    "cell-lag": ("time_constant", 0.05, False),
    "cell-hysteresis": ("fraction", 2e-3, False),
    "torque-constant": ("gain_error", 0.03, True),
    "motor-coulomb": ("torque", 0.02, False),
    "motor-coulomb-asymmetry": ("offset", 0.01, True),
    "motor-viscous": ("viscosity", 1e-3, False),
    "rotor-inertia": ("inertia", 1e-4, False),
    "torque-lag": ("time_constant", 0.02, False),
    "outside-crosstalk": ("size", 0.02, True),
    "outside-shaken-length": ("size", 1e-5, True),
    "outside-wander": ("size", 5e-4, True),
    "outside-platform": ("step", 5e-4, True),
    "outside-square-drag": ("drag", 10.0, False),
}
_SOFT = {
    "cable-elongation-linear": ("axial_stiffness", 2e5),
    "frame-compliance": ("stiffness", 2e5),
}


def _shaped(effect: str, random: Random, winch: Winch, scene: Scene) -> Sized:
    phase = random.uniform(-pi, pi)
    low, high = 9.8 * min(scene.masses), 9.8 * max(scene.masses)
    match effect:
        case "drum-eccentricity":
            return lambda z: {"eccentricity": 2e-4 * z, "phase": phase}
        case "gear-transmission-error":
            order = float(random.choice([1, 2, 3, 4, 6, 8, 12]))
            return lambda z: {"amplitude": 2e-4 * z, "phase": phase, "order": order}
        case "gear-backlash":
            # Whether the motor feels no load within the play, or is held on a flank.
            opens = float(random.integers(0, 2))
            return lambda z: {"gap": 4e-3 * z, "opens": opens}
        case "motor-cogging":
            order = float(random.choice([2, 4, 6, 12]))
            return lambda z: {"amplitude": 0.01 * z, "phase": phase, "order": order}
        case "encoder-slip":
            when, sign = random.uniform(0.2, 0.8) * scene.seconds, random.choice([-1.0, 1.0])
            return lambda z: {"step": sign * 0.02 * z, "time": when}
        case "guide-offset":
            aside, back = random.uniform(-0.02, 0.02), random.choice([-1.0, 1.0])
            return lambda z: {"offset": aside * z**0.5, "mismatch": back * 1e-3 * z**0.5}
        case "cable-elongation-quartic":
            b2, b3 = random.uniform(100, 600), random.uniform(0, 1e5)
            return lambda z: {"k1": 2e5 / z, "b2": b2 / z, "b3": b3 / z**2, "b4": 0.0}
        case "cable-elongation-exponential":
            scale = random.uniform(0.3, 2) * low
            return lambda z: {"strain_scale": 1e-3 * z, "force_scale": scale}
        case "cable-hysteresis":
            fraction = random.uniform(0.005, 0.05)
            return lambda z: {"stiffness": 2e5 / z, "fraction": fraction}
        case "cable-creep":
            tau = random.uniform(0.08, 0.6) * scene.seconds
            return lambda z: {"creep_stiffness": 1e6 / z, "time_constant": tau}
        case "cell-creep":
            tau = random.uniform(0.08, 0.6) * scene.seconds
            return lambda z: {"fraction": 3e-3 * z, "time_constant": tau}
        case "pulley-stribeck":
            speed, more = random.uniform(0.01, 0.08), random.uniform(1.4, 2.5)
            return lambda z: {
                "coulomb": 0.015 * z,
                "static": 0.015 * z * more,
                "stribeck_speed": speed,
            }
        case "pulley-dahl":
            reach = random.uniform(3e-3, 3e-2)
            return lambda z: {"friction": 0.02 * z, "stiffness": 0.02 * z * low / reach}
        case "motor-stribeck":
            speed = random.uniform(1.0, 6.0)
            return lambda z: {"torque": 0.02 * z, "stribeck_speed": speed}
        case "gear-efficiency":
            return lambda z: {"efficiency": float(np.exp(-0.1 * z))}
        case "outside-harmonic":
            return lambda z: {"amplitude": 3e-4 * z, "phase": phase}
        case "outside-sticky-place":
            part = random.uniform(0.3, 0.7)
            place = winch.length_reference + part * scene.stroke
            return lambda z: {"force": 3.0 * z, "place": place, "width": 0.06 * scene.stroke}
        case "outside-mis-spooling":
            gone = random.uniform(0.3, 0.7) * scene.stroke / winch.radius
            angle = 2 * pi * winch.wound_turns - gone
            return lambda z: {"jump": 1e-4 * z, "angle": angle}
        case "outside-joint":
            force = random.uniform(0.62, 0.8) * high
            return lambda z: {"force": force, "stiffness": 2e5 / z}
        case "outside-clipping":
            return lambda z: {"most": high * (1.02 - 0.04 * min(z, 20.0))}
    raise KeyError(effect)
