"""Effects that a machine may have and its declaration lacks: the physics of each.

Sources: G. Niemann, H. Winter, Maschinenelemente; K. Feyrer, Drahtseile; J. Hanselman, Brushless
Permanent Magnet Motor Design; OIML R 60 (load cells); Olsson and others 1998 (friction).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import pi

import numpy as np

from missing_physics.frictions import FORMS, share, stribeck
from missing_physics.machine import FINE, GRAVITY, PULLEY_RADIUS, Array, Machine, Motion, Random


@dataclass(frozen=True)
class State:
    """What holds at each fine step; effects replace single quantities, stage by stage."""

    machine: Machine
    motion: Motion
    drum: Array
    """Drum angle since the reference, rad."""
    gear: Array
    """Its derivative by the motor angle."""
    wound: Array
    """Cable on the drum, m."""
    arm: Array
    """Derivative of ``wound`` by the drum angle, m."""
    tension: Array
    """At the winch, N."""
    cable_length: Array
    """Free, m; after its stage what the counter shows."""
    motor_torque: Array
    """N m."""

    @property
    def reel(self) -> Array:
        """Speed at which cable is wound in, m/s."""
        return self.arm * self.gear * self.motion.speed

    @property
    def free(self) -> Array:
        """Free cable without strain, m."""
        zero = float(self.machine.wound(np.zeros(1))[0])
        return self.machine.length + zero - self.wound

    @property
    def stressed(self) -> Array:
        """Cable under tension, m."""
        return self.free + self.machine.dead_length


Parameters = dict[str, float]
"""Of one hidden effect; ``size`` among them."""
Added = Callable[[State, Parameters], Array]
Drawn = Callable[[Random, Motion], Parameters]
STAGES = ("drum", "wound", "tension", "torque", "length", "counter", "cell", "signal")
QUANTITY = {
    **{"drum": "drum", "wound": "wound", "tension": "tension", "cell": "tension"},
    **{"torque": "motor_torque", "signal": "motor_torque"},
    **{"length": "cable_length", "counter": "cable_length"},
}
MOST = 10.0
"""Times the usual size: beyond it, the runs do not excite an effect."""


@dataclass(frozen=True)
class Effect:
    """One effect: where it acts, and what a unit of it adds there."""

    stage: str
    added: Added
    """To the quantity of its stage, per unit of size."""
    size: float | None = None
    """Usual one, SI; without it the noise of the torque, and no bound."""
    where: str = "both"
    """``winch``, ``axis``, ``both``; ``gear``, ``layers``, ``warm``: winches that have it;
    ``slow``: the samples resolve an order of the motor angle."""
    drawn: Drawn = lambda _random, _motion: {}
    """Its other parameters."""
    names: tuple[str, ...] = ()
    """Answers that are right where its own name is none, or not the only one."""


@dataclass(frozen=True)
class Hidden:
    """An effect with its parameters, SI."""

    name: str
    parameters: Parameters


def outputs(machine: Machine, run: Motion, hidden: tuple[Hidden, ...] = ()) -> dict[str, Array]:
    """What ideal instruments show of a run, by output; (n,) at fine steps."""
    drum, none = run.angle / machine.ratio, np.zeros_like(run.angle)
    gear = np.full_like(drum, 1 / machine.ratio)
    state = State(machine, run, drum, gear, none, none, none, none, none)
    for stage in STAGES:
        state = _declared(stage, state)
        for one in hidden:
            if ALL[one.name].stage == stage:
                added = one.parameters["size"] * ALL[one.name].added(state, one.parameters)
                state = _with(stage, state, added)
    return {name: getattr(state, name) for name in machine.outputs}


def _declared(stage: str, s: State) -> State:
    """The declared machine at a stage."""
    machine, run, winch = s.machine, s.motion, s.machine.kind == "winch"
    if stage == "wound" and winch:
        return replace(s, wound=machine.wound(s.drum), arm=machine.arm(s.drum))
    if stage == "tension" and winch:
        return replace(s, tension=run.mass * (GRAVITY + np.gradient(s.reel, 1 / FINE)))
    if stage == "torque":
        torque = machine.inertia * run.acceleration + s.tension * s.arm * s.gear
        return replace(s, motor_torque=torque)
    if stage == "length" and winch:
        return replace(s, cable_length=s.free)
    return s


def _with(stage: str, s: State, added: Array) -> State:
    """The state with a changed quantity; of angles and ways also their derivatives."""
    changed = {QUANTITY[stage]: getattr(s, QUANTITY[stage]) + added}
    by = {"drum": s.motion.angle, "wound": s.drum}.get(stage)
    if by is not None:
        step = np.gradient(by)
        still = np.abs(step) < 1e-9
        rate = np.where(still, 0.0, np.gradient(added) / np.where(still, 1.0, step))
        derivative = {"drum": "gear", "wound": "arm"}[stage]
        changed[derivative] = getattr(s, derivative) + rate
    return replace(s, **changed)


def lag(signal: Array, seconds: float) -> Array:
    """First-order low-pass, exact for a signal that is constant within each step."""
    keep, out, value = float(np.exp(-1 / (FINE * max(seconds, 1e-6)))), [], float(signal[0])
    for x in signal.tolist():
        value = x + (value - x) * keep
        out.append(value)
    return np.asarray(out)


def later(signal: Array, seconds: float) -> Array:
    """The signal as it was before, samples in between by straight lines."""
    at = np.arange(len(signal)) / FINE
    return np.interp(at - seconds, at, signal)


def bearing(s: State) -> Array:
    """Sum of the forces on the bearings of the pulleys, N: the cable's both ends, turned."""
    return s.tension * sum(2 * np.sin(wrap / 2) for wrap in s.machine.wraps)


def layers(s: State, _p: Parameters) -> Array:
    """Cable that a growth of the radius by 1 m per turn adds, m."""
    return ((s.drum + 2 * pi * s.machine.turns) ** 2 - (2 * pi * s.machine.turns) ** 2) / (4 * pi)


def gear_loss(s: State, p: Parameters) -> Array:
    """Teeth lose a share of the power, whichever way it goes (Niemann, Winter)."""
    lost = (1 - p["size"]) ** -np.tanh(s.reel / 1e-3) - 1
    return s.tension * s.arm * s.gear * lost / p["size"]


def lagged(name: str) -> Added:
    """A first-order filter of an instrument; its time constant is the size."""
    return lambda s, p: (lag(getattr(s, name), p["size"]) - getattr(s, name)) / p["size"]


def late(s: State, p: Parameters) -> Array:
    """A counter whose reading is late; the delay is the size."""
    return (later(s.cable_length, p["size"]) - s.cable_length) / p["size"]


def turning(of: Callable[[State], Array]) -> Added:
    """A sine of an angle."""
    return lambda s, p: np.sin(p.get("order", 1.0) * of(s) + p["phase"])


def motor_form(name: str) -> Added:
    """Friction of the motor side with the reversal of a form."""
    return lambda s, p: share(name, s.motion.speed, p["scale"])


def pulley_form(name: str) -> Added:
    """Friction of the pulleys' bearings with the reversal of a form."""
    return lambda s, p: bearing(s) * share(name, s.reel, p["scale"])


def warming(s: State, _p: Parameters) -> Array:
    """Temperature above 20 °C."""
    return s.motion.temperature - 20


def drawn(**between: tuple[float, float]) -> Drawn:
    """Parameters uniform between two values."""
    return lambda random, _run: {name: random.uniform(*ends) for name, ends in between.items()}


def spread(low: float, high: float, *, of_speed: bool = False) -> Drawn:
    """A scale whose logarithm is uniform; of the greatest speed of the motor, or absolute."""

    def scale(random: Random, run: Motion) -> Parameters:
        unit = float(np.max(np.abs(run.speed))) if of_speed else 1.0
        return {"scale": unit * float(np.exp(random.uniform(np.log(low), np.log(high))))}

    return scale


PHASE = drawn(phase=(0, 2 * pi))
FAST = spread(0.1, 0.25, of_speed=True)
"""A Stribeck speed well within those of the run, rad/s."""
SHARP, SHARP_REEL = spread(3e-4, 0.01, of_speed=True), spread(1e-4, 3e-3)
"""A reversal within a hundredth of the greatest speed, rad/s; of the cable, m/s."""
PRESLIDING = spread(0.03, 2.0)
"""A distance of presliding, rad."""


def order(random: Random, run: Motion) -> Parameters:
    """A low order of the motor angle."""
    return PHASE(random, run) | {"order": float(random.choice([2, 3, 4]))}


MOTOR, DRUM = turning(lambda s: s.motion.angle), turning(lambda s: s.drum)

CATALOGUE: dict[str, Effect] = {
    "gear-ratio": Effect("drum", lambda s, _: -s.drum, 0.003, "gear"),
    "drum-radius": Effect("wound", lambda s, _: s.drum, 0.0003, "winch"),
    "layer-thickness": Effect("wound", layers, 0.0001, "layers"),
    "drum-eccentricity": Effect("wound", DRUM, 0.0003, "winch", PHASE),
    "pulley-coulomb": Effect("tension", pulley_form("tanh"), 0.015, "winch", SHARP_REEL),
    "pulley-viscous": Effect("tension", lambda s, _: s.reel, 20.0, "winch"),
    "pulley-inertia": Effect("tension", lambda s, _: np.gradient(s.reel, 1 / FINE), 1.0, "winch"),
    "cable-weight": Effect("tension", lambda s, _: GRAVITY * s.free, 0.1, "winch"),
    "gear-efficiency": Effect("torque", gear_loss, 0.05, "gear"),
    "motor-coulomb": Effect("torque", motor_form("tanh"), None, "both", SHARP),
    "motor-viscous": Effect("torque", lambda s, _: s.motion.speed),
    "motor-stribeck": Effect(
        "torque", lambda s, p: stribeck(s.motion.speed, p["scale"]), None, "both", FAST
    ),
    "motor-coulomb-asymmetry": Effect("torque", lambda s, _: np.ones_like(s.drum)),
    "motor-cogging": Effect("torque", MOTOR, None, "slow", order),
    "joint-gravity": Effect(
        "torque", DRUM, None, "axis", PHASE, ("joint-gravity", "drum-unbalance")
    ),
    "drum-unbalance": Effect("torque", DRUM, None, "winch", PHASE),
    "cable-elongation-linear": Effect("length", lambda s, _: s.stressed * s.tension, 5e-6, "winch"),
    "frame-compliance": Effect("length", lambda s, _: s.tension, 5e-6, "winch"),
    "cable-thermal": Effect("length", lambda s, p: s.stressed * warming(s, p), 1e-5, "warm"),
    "cable-creep": Effect(
        "length",
        lambda s, p: s.stressed * lag(s.tension, p["time"]),
        1e-6,
        "winch",
        drawn(time=(3, 15)),
    ),
    "length-time-offset": Effect("counter", late, 0.01, "winch"),
    "cell-gain": Effect("cell", lambda s, _: s.tension, 0.01, "winch"),
    "cell-offset": Effect("cell", lambda s, _: np.ones_like(s.drum), 4.0, "winch"),
    "cell-nonlinearity": Effect("cell", lambda s, _: (s.tension / 500) ** 2, 5.0, "winch"),
    "cell-drift": Effect("cell", lambda s, _: s.motion.time, 0.05, "winch"),
    "cell-thermal": Effect("cell", warming, 0.5, "warm"),
    "cell-lag": Effect("cell", lagged("tension"), 0.1, "winch"),
    "torque-constant": Effect("signal", lambda s, _: s.motor_torque, 0.02, "winch"),
    "torque-lag": Effect("signal", lagged("motor_torque"), 0.02),
    "torque-ripple": Effect(
        "signal", lambda s, p: MOTOR(s, p) * s.motor_torque, 0.02, "slow", order
    ),
}
"""Effects with a name that an entrant can answer."""

FRICTIONS: dict[str, Effect] = {
    f"motor-friction-{form}": Effect(
        *("torque", motor_form(form), None, "both"),
        PRESLIDING if form == "dahl" else SHARP,
        ("motor-coulomb", "motor-dahl"),
    )
    for form in FORMS
} | {
    f"pulley-friction-{form}": Effect(
        *("tension", pulley_form(form), 0.015, "winch"),
        SHARP_REEL,
        ("pulley-coulomb", "pulley-dahl", "pulley-capstan"),
    )
    for form in FORMS
}
"""Friction of many reversals: by its law of sliding or of presliding, as the runs show it."""

OUTSIDE: dict[str, Effect] = {
    "windage": Effect("torque", lambda s, _: s.motion.speed * np.abs(s.motion.speed)),
    "hardening-spring": Effect("torque", lambda s, _: (s.drum / (2 * pi)) ** 3, None, "axis"),
    "supply-hum": Effect(
        "signal",
        lambda s, p: np.sin(2 * pi * p["rate"] * s.motion.time + p["phase"]),
        *(None, "both"),
        drawn(phase=(0, 2 * pi), rate=(0.2, 1.5)),
    ),
    "pulley-runout": Effect(
        *("counter", turning(lambda s: s.cable_length / PULLEY_RADIUS), 3e-4, "winch"), PHASE
    ),
    "swinging-load": Effect(
        "cell",
        lambda s, p: (
            s.tension * np.sin(2 * np.sqrt(GRAVITY / s.machine.length) * s.motion.time + p["phase"])
        ),
        *(0.01, "winch"),
        PHASE,
    ),
    "magnetic-saturation": Effect(
        "signal",
        lambda s, _: s.motor_torque * (s.motor_torque / s.machine.noise["motor_torque"]) ** 2,
        *(2e-6, "winch"),
    ),
}
"""Effects that have no name here; the right answer is ``unknown``."""

ALL = {**CATALOGUE, **FRICTIONS, **OUTSIDE}


def possible(effect: Effect, machine: Machine, warm: bool) -> bool:
    """Whether a machine can have an effect."""
    winch = machine.kind == "winch"
    return {
        "both": True,
        "axis": not winch,
        "winch": winch,
        "gear": winch and machine.ratio != 1,
        "layers": winch and machine.drum == "archimedean",
        "warm": winch and warm,
        "slow": not winch or machine.ratio == 1,
    }[effect.where]
