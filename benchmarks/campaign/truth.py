"""The campaign's physics: what the instruments of a winch show, with what it hides.

A third implementation of the line, next to the package's model and its simulator: written from
the catalogue's formulas alone, numpy and plain loops. ``hidden`` maps an effect's id to its
parameters under the catalogue's names; ids that begin with ``outside-`` are of no catalogue.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from campaign.memory import dahl, lag, play, stack
from campaign.winch import Winch
from winchkit.arrays import Array

Values = Mapping[str, float]
Hidden = Mapping[str, Values]
OUTPUTS = ("cable_length", "tension", "motor_torque")
G = 9.80665
TURN = 2 * np.pi
CREEP_RATE, CREEP_SPEED = 0.05, 5e-5
"""rad/s of the motor (0.5 rpm) and m/s of the cable, up to which friction rises linearly."""


@dataclass(frozen=True)
class Situation:
    """What one run is made of, SI; arrays (n,)."""

    time: Array
    motor_angle: Array
    mass: float
    """As the runs state it."""
    temperature: Array
    wander: Array
    """A slow curve of rms one, the same in every run."""
    every: int = 1
    """Physics steps per sample: instruments see one of so many."""


@dataclass(frozen=True)
class Shown:
    """What ideal instruments show, SI; (n,)."""

    cable_length: Array
    tension: Array
    motor_torque: Array
    load: Array
    """As the runs state it."""


def show(winch: Winch, run: Situation, hidden: Hidden) -> Shown:
    """Run the winch."""
    return _Line(winch, run, hidden).shown()


def _way(rate: Array, creep: float) -> Array:
    """Direction of a motion without noise."""
    return np.clip(rate / creep, -1.0, 1.0)


class _Line:
    def __init__(self, winch: Winch, run: Situation, hidden: Hidden) -> None:
        self.winch, self.run, self.hidden = winch, run, hidden
        self.time = run.time - run.time[0]
        self.motor_rate = np.gradient(run.motor_angle, run.time)
        self.drum_angle = winch.direction * (run.motor_angle - winch.motor_reference) / winch.ratio
        total = TURN * winch.wound_turns + self.drum_angle
        self.speed = np.gradient(wound_cable(winch, total, 0.0, 0.0), run.time)
        self.s = _way(self.speed, CREEP_SPEED)

    def get(self, effect: str) -> Values | None:
        return self.hidden.get(effect)

    def shown(self) -> Shown:
        free, arm = self._path()
        stated = self.run.mass * (G - np.gradient(np.gradient(free, self.time), self.time))
        load = stated * (1 + (self.get("load-gain") or {}).get("gain_error", 0.0))
        drum_side = self._to_the_drum(load, free)
        length = self._rope(free, load)
        torque = self._torque(drum_side, arm, free)
        ideal = length, self._cell(drum_side, torque), torque, stated
        return Shown(*(channel[:: self.run.every] for channel in ideal))

    def _turned(self, motor_angle: Array) -> Array:
        winch = self.winch
        angle = winch.direction * (motor_angle - winch.motor_reference) / winch.ratio
        if p := self.get("gear-ratio"):
            angle = angle / (1 + p["ratio_error"])
        for name, p in self.hidden.items():
            if name.startswith("gear-transmission-error"):
                angle = angle + p["amplitude"] * np.sin(p["order"] * motor_angle + p["phase"])
        return angle

    def _wound_in(self, angle: Array) -> Array:
        """Cable taken up at a drum angle, the guide's detour and eccentricity included."""
        winch = self.winch
        dr = (self.get("drum-radius") or {}).get("radius_error", 0.0)
        dg = (self.get("layer-thickness") or {}).get("thickness_error", 0.0)
        total, start = TURN * winch.wound_turns + angle, TURN * winch.wound_turns
        length = wound_cable(winch, total, dr, dg) - wound_cable(winch, np.array(start), dr, dg)
        if p := self.get("drum-eccentricity"):
            length = length + p["eccentricity"] * (np.sin(angle - p["phase"]) + np.sin(p["phase"]))
        if p := self.get("guide-offset"):
            aside = p["offset"] + p["mismatch"] * total / TURN
            h = winch.guide_distance
            length = length + np.sqrt(h**2 + aside**2) - h
        if p := self.get("outside-mis-spooling"):
            length = length + p["jump"] * np.maximum(total - p["angle"], 0.0)
        return length

    def _path(self) -> tuple[Array, Array]:
        """Unstrained free length, and the arm by virtual work (a small turn of the motor)."""
        theta, small = self.run.motor_angle, 1e-5
        angle = self._turned(theta)
        more, less = self._turned(theta + small), self._turned(theta - small)
        sticks = np.ones_like(theta)
        if p := self.get("gear-backlash"):
            followed = play(angle, p["gap"])
            if p["opens"]:
                sticks = (np.abs(followed - angle) > 0.4999 * p["gap"]).astype(float)
            more, less, angle = more + followed - angle, less + followed - angle, followed
        if p := self.get("encoder-slip"):
            done = np.clip((self.time - p["time"]) / 0.4, 0, 1)
            slipped = p["step"] * (1 - np.cos(np.pi * done)) / 2
            angle, more, less = angle + slipped, more + slipped, less + slipped
        arm = sticks * (self._wound_in(more) - self._wound_in(less)) / (2 * small)
        self.turned = angle
        return self.winch.length_reference - self._wound_in(angle), arm

    def _rope(self, free: Array, load: Array) -> Array:
        strain = self._strain(load)
        stressed = free + self.winch.dead_length
        length = free + stressed * strain
        if p := self.get("cable-sag"):
            w = p["mass_per_length"] * G * np.cos(np.radians(self.winch.inclination))
            length = length - w**2 * free**3 / (24 * load**2)
        if p := self.get("drum-winding-tension"):
            length = length + stack(
                self.winch.length_reference - free, p["fraction"] * load / 500.0
            )
        if p := self.get("frame-compliance"):
            length = length + load / p["stiffness"]
        if p := self.get("outside-joint"):
            length = length + np.maximum(load - p["force"], 0.0) / p["stiffness"]
        if p := self.get("outside-harmonic"):
            length = length + p["amplitude"] * np.sin(5 * self.drum_angle + p["phase"])
        if p := self.get("outside-wander"):
            length = length + p["size"] * self.run.wander
        if p := self.get("outside-shaken-length"):
            length = length + p["size"] * np.gradient(self.motor_rate, self.time)
        if p := self.get("outside-platform"):
            transient_mask = np.gradient(self.speed, self.time)
            length = length + p["step"] * np.tanh(lag(transient_mask, self.time, 0.5, 0.0) / 0.02)
        length = length * (1 + (self.get("length-gain") or {}).get("gain_error", 0.0))
        if p := self.get("length-time-offset"):
            length = np.interp(self.time - p["delay"], self.time, length)
        return length

    def _strain(self, load: Array) -> Array:
        strain = np.zeros_like(load)
        if p := self.get("cable-elongation-linear"):
            strain = strain + load / p["axial_stiffness"]
        if p := self.get("cable-elongation-quartic"):
            e = np.linspace(0, 0.05, 200_001)
            force = p["k1"] * (e + p["b2"] * e**2 + p["b3"] * e**3 + p["b4"] * e**4)
            strain = strain + np.interp(load, force, e)
        if p := self.get("cable-elongation-exponential"):
            strain = strain + p["strain_scale"] * np.log(1 + load / p["force_scale"])
        if p := self.get("cable-hysteresis"):
            force = dahl(load, p["fraction"] * load, np.full_like(load, 0.5))
            strain = strain - force / p["stiffness"]
        if p := self.get("cable-creep"):
            settled = load / p["creep_stiffness"]
            strain = strain + lag(settled, self.time, p["time_constant"], 0.0)
        if p := self.get("cable-thermal"):
            strain = strain + p["expansion"] * (self.run.temperature - 20.0)
        return strain

    def _to_the_drum(self, load: Array, free: Array) -> Array:
        tension = load
        if p := self.get("cable-weight"):
            up = np.sin(np.radians(self.winch.inclination))
            tension = tension + p["mass_per_length"] * G * free * up
        if p := self.get("load-lever"):
            tension = tension * (1 + p["amplitude"] * np.sin(self.drum_angle + p["phase"]))
        for wrap in reversed(self.winch.wraps):
            tension = self._over_pulley(tension, np.radians(wrap), free)
        if p := self.get("outside-sticky-place"):
            here = np.exp(-(((free - p["place"]) / p["width"]) ** 2))
            tension = tension + p["force"] * self.s * here
        if p := self.get("outside-square-drag"):
            tension = tension + p["drag"] * self.speed * np.abs(self.speed)
        return tension

    def _over_pulley(self, before: Array, wrap: float, free: Array) -> Array:
        after = before
        if p := self.get("pulley-coulomb"):
            after = bearing_friction(before, self.s * p["friction"], wrap)
        if p := self.get("pulley-stribeck"):
            slow = np.exp(-((self.speed / p["stribeck_speed"]) ** 2))
            mu = p["coulomb"] + (p["static"] - p["coulomb"]) * slow
            after = bearing_friction(after, self.s * mu, wrap)
        if p := self.get("pulley-capstan"):
            after = after * np.exp(self.s * p["friction"] * wrap)
        if p := self.get("pulley-dahl"):
            limit = bearing_friction(before, np.full_like(before, p["friction"]), wrap) - before
            after = after + dahl(-free, limit, np.full_like(limit, p["stiffness"]))
        if p := self.get("pulley-viscous"):
            after = after + p["viscosity"] * self.speed
        if p := self.get("pulley-inertia"):
            after = after + p["equivalent_mass"] * np.gradient(self.speed, self.time)
        return after

    def _cell(self, tension: Array, torque: Array) -> Array:
        shown = tension * (1 + (self.get("cell-gain") or {}).get("gain_error", 0.0))
        shown = shown + (self.get("cell-offset") or {}).get("offset", 0.0)
        if p := self.get("cell-nonlinearity"):
            shown = shown + p["quadratic"] * (shown / 500.0) ** 2
        shown = shown + (self.get("cell-drift") or {}).get("drift", 0.0) * self.time
        if p := self.get("cell-thermal"):
            shown = shown + p["sensitivity"] * (self.run.temperature - 20.0)
        if p := self.get("cell-hysteresis"):
            limit = p["fraction"] * shown
            shown = shown - dahl(shown, limit, np.full_like(shown, p["fraction"] / 0.1))
        if p := self.get("cell-creep"):
            shown = shown + p["fraction"] * lag(shown, self.time, p["time_constant"], 0.0)
        if p := self.get("cell-crosstalk"):
            shown = shown + p["share"] * torque
        if p := self.get("cell-clipping"):
            shown = shown - p["share"] * np.maximum(shown - p["limit"], 0.0)
        if p := self.get("outside-clipping"):
            shown = np.minimum(shown, p["most"])
        if p := self.get("cell-lag"):
            shown = lag(shown, self.time, p["time_constant"], float(shown[0]))
        return shown

    def _presliding(self) -> Array | float:
        """Friction of the motor side that builds up over its angle."""
        p = self.get("motor-dahl")
        if not p:
            return 0.0
        limit = np.full_like(self.run.motor_angle, p["torque"])
        return dahl(self.run.motor_angle, limit, limit / p["distance"])

    def _torque(self, tension: Array, arm: Array, free: Array) -> Array:
        torque = tension * arm
        rate = self.motor_rate
        if p := self.get("gear-efficiency"):
            torque = torque * p["efficiency"] ** (-self.s)
        torque = torque * (1 + (self.get("torque-constant") or {}).get("gain_error", 0.0))
        way = _way(rate, CREEP_RATE)
        torque = torque + self._presliding()
        torque = torque + (self.get("motor-coulomb") or {}).get("torque", 0.0) * way
        torque = torque + (self.get("motor-coulomb-asymmetry") or {}).get("offset", 0.0)
        torque = torque + (self.get("motor-viscous") or {}).get("viscosity", 0.0) * rate
        if p := self.get("motor-viscous-asymmetry"):
            torque = torque + p["viscosity_difference"] * np.abs(rate)
        if p := self.get("motor-stribeck"):
            torque = torque + way * p["torque"] * np.exp(-((rate / p["stribeck_speed"]) ** 2))
        if p := self.get("motor-cogging"):
            turned = p["order"] * self.run.motor_angle + p["phase"]
            torque = torque + p["amplitude"] * np.sin(turned)
        torque = torque + (self.get("friction-growth") or {}).get("rate", 0.0) * self.time * way
        if p := self.get("friction-at-place"):
            distance = (self.drum_angle - p["place"]) / p["width"]
            torque = torque + p["torque"] * way * np.exp(-(distance**2))
        if p := self.get("drum-unbalance"):
            torque = torque + p["amplitude"] * np.sin(self.drum_angle + p["phase"])
        if p := self.get("spring-balancer"):
            torque = torque + p["stiffness"] * self.drum_angle + p["torque"]
        if p := self.get("rotor-inertia"):
            torque = torque + p["inertia"] * np.gradient(rate, self.time)
        if p := self.get("outside-crosstalk"):
            torque = torque + p["size"] * (free - self.winch.length_reference)
        if p := self.get("torque-ripple"):
            turned = p["order"] * self.run.motor_angle + p["phase"]
            torque = torque * (1 + p["amplitude"] * np.sin(turned))
        if p := self.get("torque-lead"):
            torque = np.interp(self.time + p["lead"], self.time, torque)
        if p := self.get("torque-lag"):
            torque = lag(torque, self.time, p["time_constant"], float(torque[0]))
        return torque


def wound_cable(winch: Winch, total: Array, dr: float, dg: float) -> Array:
    """Cable on the drum at the total wound angle, by the four winding laws."""
    r, g = winch.radius + dr, winch.growth + dg
    if winch.kind == "grooved":
        return total * np.sqrt(r**2 + (winch.growth / TURN) ** 2)
    if winch.kind == "archimedean":
        return r * total + g * total**2 / (4 * np.pi)
    if winch.kind == "squared":
        # r² = r0² + k L and dL = r dΦ give r = r0 + k Φ/2.
        return r * total + winch.growth * total**2 / 4
    n = np.floor(total / TURN)
    return (total - TURN * n) * (r + n * g) + TURN * (n * r + g * n * (n - 1) / 2)


def bearing_friction(before: Array, mu: Array, wrap: float) -> Array:
    """T1 = T0 + μ N(T0, T1), N the force on the pulley, by iteration."""
    after = before
    for _ in range(12):
        square = before**2 - 2 * before * after * np.cos(wrap) + after**2
        after = before + mu * np.sqrt(square)
    return after
