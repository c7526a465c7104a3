"""Shapes of hidden effects, drawn at random, and their values at a given size."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import product
from math import pi
from typing import TypeVar

import numpy as np

from campaign.winch import Winch

Random = np.random.Generator
T = TypeVar("T")
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
    "motor-viscous", "motor-stribeck", "motor-cogging",
    "rotor-inertia", "torque-lag", "motor-viscous-asymmetry", "torque-lead",
)  # fmt: skip
CATALOGUE = LENGTH + TENSION + TORQUE
OUTSIDE = (
    "outside-harmonic", "outside-crosstalk", "outside-shaken-length", "outside-sticky-place",
    "outside-mis-spooling", "outside-joint", "outside-wander", "outside-clipping",
    "outside-platform", "outside-square-drag",
)  # fmt: skip
RECENT = (
    "load-lever", "cell-crosstalk", "cell-clipping", "friction-growth", "friction-at-place",
    "drum-unbalance", "spring-balancer", "torque-ripple", "motor-dahl", "length-gain", "load-gain",
)  # fmt: skip
"""Effects that the catalogue got after seeds were first drawn."""

CATALOGUED = {
    "outside-crosstalk": "spring-balancer",
    "outside-clipping": "cell-clipping",
    "outside-sticky-place": "load-friction-at-place",
}
"""Physics that was outside the catalogue when seeds were first drawn, and its name there now."""


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
        "load-lever": load_known,
        "load-gain": load_known,
        "cell-crosstalk": load_known,
        "cell-clipping": load_known,
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


def shapes(effect: str, winch: Winch, scene: Scene) -> list[Sized]:
    """The values of an effect as functions of its size, for a grid of its shape.

    The grid has the middles of equal parts of the range from which every shape parameter is drawn,
    either sign, and two phases a quarter turn apart.
    """
    if effect in _ONE:
        name, typical, either_sign = _ONE[effect]
        return [
            lambda size, sign=sign: {name: sign * typical * size}
            for sign in ((1.0, -1.0) if either_sign else (1.0,))
        ]
    if effect in _SOFT:
        name, typical = _SOFT[effect]
        return [lambda size: {name: typical / size}]
    parts = _PARTS.get(effect, ())
    grid = product(*([(k + 0.5) / count for k in range(count)] for count in parts))
    phases = (0.0, pi / 2) if effect in PHASED else (0.0,)
    return [
        _SHAPED[effect](_Shape(_Quantiles(list(at)), winch, scene, phase))
        for at in grid
        for phase in phases
    ]


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
    "drum-winding-tension": ("fraction", 5e-3, False),
    "length-time-offset": ("delay", 0.02, False),
    "length-gain": ("gain_error", 5e-3, True),
    "load-gain": ("gain_error", 0.01, True),
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
    "motor-viscous-asymmetry": ("viscosity_difference", 3e-4, True),
    "torque-lead": ("lead", 5e-3, False),
    "friction-growth": ("rate", 2e-4, True),
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


@dataclass
class _Quantiles:
    """Gives quantiles in turn where a random generator gives numbers."""

    left: list[float] = field(default_factory=list)

    def uniform(self, low: float, high: float) -> float:
        """Quantile of the uniform distribution."""
        return low + self.left.pop(0) * (high - low)

    def choice(self, among: Sequence[T]) -> T:
        """Quantile of a list."""
        return among[int(self.left.pop(0) * len(among))]

    def integers(self, low: int, high: int) -> int:
        """Quantile of low … high − 1."""
        return low + int(self.left.pop(0) * (high - low))


@dataclass(frozen=True)
class _Shape:
    """What an effect's shape is drawn from."""

    random: Random | _Quantiles
    winch: Winch
    scene: Scene
    phase: float

    @property
    def low(self) -> float:
        """Smallest load, N."""
        return 9.8 * min(self.scene.masses)

    @property
    def high(self) -> float:
        """Largest load, N."""
        return 9.8 * max(self.scene.masses)


def _shaped(effect: str, random: Random, winch: Winch, scene: Scene) -> Sized:
    return _SHAPED[effect](_Shape(random, winch, scene, random.uniform(-pi, pi)))


def _eccentricity(d: _Shape) -> Sized:
    return lambda z: {"eccentricity": 2e-4 * z, "phase": d.phase}


def _transmission_error(d: _Shape) -> Sized:
    order = float(d.random.choice([1, 2, 3, 4, 6, 8, 12]))
    return lambda z: {"amplitude": 2e-4 * z, "phase": d.phase, "order": order}


def _backlash(d: _Shape) -> Sized:
    # Whether the motor feels no load within the play, or is held on a flank.
    opens = float(d.random.integers(0, 2))
    return lambda z: {"gap": 4e-3 * z, "opens": opens}


def _ripple(d: _Shape) -> Sized:
    order = float(d.random.choice([2, 4, 6, 12]))
    return lambda z: {"amplitude": 0.02 * z, "phase": d.phase, "order": order}


def _lever(d: _Shape) -> Sized:
    return lambda z: {"amplitude": 0.02 * z, "phase": d.phase}


def _unbalance(d: _Shape) -> Sized:
    return lambda z: {"amplitude": 0.01 * z, "phase": d.phase}


def _spring(d: _Shape) -> Sized:
    way, level = float(d.random.choice([-1.0, 1.0])), d.random.uniform(-1, 1)
    return lambda z: {"stiffness": way * 1e-3 * z, "torque": 0.01 * z * level}


def _place(d: _Shape) -> Sized:
    stroke = d.scene.stroke / d.winch.radius
    place, width = -d.random.uniform(0.2, 0.8) * stroke, 0.1 * stroke
    return lambda z: {"torque": 0.02 * z, "place": place, "width": width}


def _crosstalk(d: _Shape) -> Sized:
    way = float(d.random.choice([-1.0, 1.0]))
    return lambda z: {"share": way * 5.0 * z}


def _limit(d: _Shape) -> Sized:
    limit = d.random.uniform(0.5, 0.99) * d.high
    return lambda z: {"share": min(0.3 * z, 1.0), "limit": limit}


def _cogging(d: _Shape) -> Sized:
    order = float(d.random.choice([2, 4, 6, 12]))
    return lambda z: {"amplitude": 0.01 * z, "phase": d.phase, "order": order}


def _slip(d: _Shape) -> Sized:
    when = d.random.uniform(0.2, 0.8) * d.scene.seconds
    sign = float(d.random.choice([-1.0, 1.0]))
    return lambda z: {"step": sign * 0.02 * z, "time": when}


def _sag(_: _Shape) -> Sized:
    # What it takes from the length goes with the square of the weight.
    return lambda z: {"mass_per_length": 0.14 * z**0.5}


def _guide(d: _Shape) -> Sized:
    aside = d.random.uniform(-0.02, 0.02)
    back = float(d.random.choice([-1.0, 1.0]))
    return lambda z: {"offset": aside * z**0.5, "mismatch": back * 1e-3 * z**0.5}


def _quartic(d: _Shape) -> Sized:
    b2, b3 = d.random.uniform(100, 600), d.random.uniform(0, 1e5)
    return lambda z: {"k1": 2e5 / z, "b2": b2 / z, "b3": b3 / z**2, "b4": 0.0}


def _exponential(d: _Shape) -> Sized:
    scale = d.random.uniform(0.3, 2) * d.low
    return lambda z: {"strain_scale": 1e-3 * z, "force_scale": scale}


def _rope_loop(d: _Shape) -> Sized:
    fraction = d.random.uniform(0.005, 0.05)
    return lambda z: {"stiffness": 2e5 / z, "fraction": fraction}


def _rope_creep(d: _Shape) -> Sized:
    tau = d.random.uniform(0.08, 0.6) * d.scene.seconds
    return lambda z: {"creep_stiffness": 1e6 / z, "time_constant": tau}


def _cell_creep(d: _Shape) -> Sized:
    tau = d.random.uniform(0.08, 0.6) * d.scene.seconds
    return lambda z: {"fraction": 3e-3 * z, "time_constant": tau}


def _pulley_stribeck(d: _Shape) -> Sized:
    speed, more = d.random.uniform(0.01, 0.08), d.random.uniform(1.4, 2.5)
    return lambda z: {
        "coulomb": 0.015 * z,
        "static": 0.015 * z * more,
        "stribeck_speed": speed,
    }


def _pulley_dahl(d: _Shape) -> Sized:
    reach, low = d.random.uniform(3e-3, 3e-2), d.low
    return lambda z: {"friction": 0.02 * z, "stiffness": 0.02 * z * low / reach}


def _motor_stribeck(d: _Shape) -> Sized:
    speed = d.random.uniform(1.0, 6.0)
    return lambda z: {"torque": 0.02 * z, "stribeck_speed": speed}


def _motor_dahl(d: _Shape) -> Sized:
    distance = d.random.uniform(1e-3, 2e-2) * d.scene.stroke / d.winch.radius * d.winch.ratio
    return lambda z: {"torque": 0.02 * z, "distance": distance}


def _efficiency(_: _Shape) -> Sized:
    return lambda z: {"efficiency": float(np.exp(-0.1 * z))}


def _harmonic(d: _Shape) -> Sized:
    return lambda z: {"amplitude": 3e-4 * z, "phase": d.phase}


def _sticky_place(d: _Shape) -> Sized:
    place = d.winch.length_reference + d.random.uniform(0.3, 0.7) * d.scene.stroke
    return lambda z: {"force": 3.0 * z, "place": place, "width": 0.06 * d.scene.stroke}


def _mis_spooling(d: _Shape) -> Sized:
    gone = d.random.uniform(0.3, 0.7) * d.scene.stroke / d.winch.radius
    angle = 2 * pi * d.winch.wound_turns - gone
    return lambda z: {"jump": 1e-4 * z, "angle": angle}


def _joint(d: _Shape) -> Sized:
    force = d.random.uniform(0.62, 0.8) * d.high
    return lambda z: {"force": force, "stiffness": 2e5 / z}


def _clipping(d: _Shape) -> Sized:
    return lambda z: {"most": d.high * (1.02 - 0.04 * min(z, 20.0))}


_SHAPED: dict[str, Callable[[_Shape], Sized]] = {
    "drum-eccentricity": _eccentricity,
    "gear-transmission-error": _transmission_error,
    "gear-backlash": _backlash,
    "motor-cogging": _cogging,
    "encoder-slip": _slip,
    "guide-offset": _guide,
    "cable-sag": _sag,
    "cable-elongation-quartic": _quartic,
    "cable-elongation-exponential": _exponential,
    "cable-hysteresis": _rope_loop,
    "cable-creep": _rope_creep,
    "cell-creep": _cell_creep,
    "pulley-stribeck": _pulley_stribeck,
    "pulley-dahl": _pulley_dahl,
    "motor-stribeck": _motor_stribeck,
    "motor-dahl": _motor_dahl,
    "gear-efficiency": _efficiency,
    "torque-ripple": _ripple,
    "load-lever": _lever,
    "drum-unbalance": _unbalance,
    "spring-balancer": _spring,
    "friction-at-place": _place,
    "cell-crosstalk": _crosstalk,
    "cell-clipping": _limit,
    "outside-harmonic": _harmonic,
    "outside-sticky-place": _sticky_place,
    "outside-mis-spooling": _mis_spooling,
    "outside-joint": _joint,
    "outside-clipping": _clipping,
}

PHASED = frozenset(
    {
        "drum-eccentricity",
        "gear-transmission-error",
        "motor-cogging",
        "torque-ripple",
        "load-lever",
        "drum-unbalance",
    }
)
"""Sines, whose phase is fitted with the amplitude."""
_PARTS = {
    "gear-transmission-error": (7,),
    "gear-backlash": (2,),
    "motor-cogging": (4,),
    "torque-ripple": (4,),
    "encoder-slip": (4, 2),
    "guide-offset": (3, 2),
    "cable-elongation-quartic": (2, 2),
    "cable-elongation-exponential": (3,),
    "cable-hysteresis": (3,),
    "cable-creep": (3,),
    "cell-creep": (3,),
    "pulley-stribeck": (3, 2),
    "pulley-dahl": (3,),
    "motor-stribeck": (3,),
    "motor-dahl": (3,),
    "spring-balancer": (2, 2),
    "friction-at-place": (6,),
    "cell-crosstalk": (2,),
    "cell-clipping": (4,),
}
"""Parts into which the range of every shape parameter is divided, in the order of the draws."""
