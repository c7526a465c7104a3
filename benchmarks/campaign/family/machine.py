"""A winch with friction at a part, moved in fine steps: what ideal instruments show.

Statics and kinematics as in :mod:`campaign.truth`, on drums of a smooth winding law: a spiral's
radius jumps from layer to layer, and with it the speed and, in steps as fine as these, the load.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from campaign.bench import programme
from campaign.family.friction import Shape, draw_shape, sense
from campaign.truth import TURN, G, Shown, bearing_friction, wound_cable
from campaign.winch import Winch, draw_winch, turns_for
from winchkit.arrays import Array

Random = np.random.Generator
PARTS = ("motor", "pulley", "gear")
STEP = 1e-3
"""Of the physics, s: at most 1 % of the time in which a motion begins or ends."""
RATES = (25.0, 50.0, 100.0, 200.0)
"""Of samples, Hz; each a whole number of steps."""


@dataclass(frozen=True)
class Friction:
    """Friction at a part of the machine, and viscosity beside it."""

    part: str
    law: str
    size: float
    """Torque of a motor (N m), μ of the pulleys' bearings, 1 − efficiency of a gear."""
    shape: Shape = field(default_factory=Shape)
    viscosity: float = 0.0
    """N m s of a motor, N s/m of each pulley."""


@dataclass(frozen=True)
class Machine:
    """A winch, its motions, its loads and its instruments; SI."""

    winch: Winch
    motions: tuple[tuple[Array, Array], ...]
    """Time and motor angle in fine steps, each (n,)."""
    masses: tuple[float, ...]
    load: str
    """How the load is known: ``load`` (a channel), ``mass`` (metadata) or ``cell`` (not at all)."""
    rate: float
    noise: dict[str, float]
    """Rms per channel."""
    colour: float
    """Share of the noise's power that is AR(1)."""
    counts: int
    """Of the encoder in a turn; zero for one of no resolution."""

    @property
    def words(self) -> str:
        """The machine in a line."""
        w, seconds = self.winch, [round(float(t[-1])) for t, _ in self.motions]
        return (
            f"{w.kind} dir {w.direction} ratio {w.ratio} pulleys {len(w.wraps)} {self.load} "
            f"motions {seconds} s {self.rate:g} Hz masses {self.masses} counts {self.counts} "
            f"colour {self.colour}"
        )

    @property
    def highest(self) -> tuple[float, float]:
        """Highest speed of the motor (rad/s) and of the cable (m/s)."""
        rates = [np.abs(np.gradient(motor, STEP)).max() for _, motor in self.motions]
        return float(max(rates)), float(max(rates)) * self.winch.radius / self.winch.ratio


def draw_machine(random: Random, part: str = "") -> Machine:
    """Any machine on which friction at a part (or none) is distinguishable from that elsewhere."""
    while True:
        winch = draw_winch(random)
        apart = (part != "pulley" or winch.wraps) and (part != "gear" or winch.ratio > 1)
        if winch.kind != "spiral" and apart:
            break
    seconds = float(random.uniform(30, 80))
    stroke = min(float(random.uniform(0.5, 4)), 0.8 * TURN * winch.wound_turns * winch.radius)
    heaviest = float(random.uniform(15, 60))
    parts = (1.0, 0.35, 0.6)[: int(random.integers(2, 4))]
    masses = tuple(round(heaviest * share, 2) for share in parts)
    motions = []
    for _ in range(int(random.integers(1, 3))):
        time, wound = programme(random, 1 / STEP, seconds, stroke)
        turned = winch.direction * winch.ratio * turns_for(winch, 1.0) * wound
        motions.append((time, winch.motor_reference + turned))
    known = ["load", "mass"] if part == "pulley" else ["load", "mass", "load", "mass", "cell"]
    torque = G * heaviest * winch.radius / winch.ratio
    return Machine(
        winch,
        tuple(motions),
        masses,
        str(random.choice(known)),
        float(random.choice(RATES)),
        {
            "cable_length": float(random.uniform(5e-5, 3e-4)),
            "tension": float(random.uniform(0.2, 1.5)),
            "motor_torque": float(random.uniform(0.003, 0.01)) * torque,
            "load": float(random.uniform(0.1, 1.0)),
        },
        float(random.choice([0.0, 0.3, 0.6])),
        int(random.choice([0, 2**14, 2**17, 2**20])),
    )


def draw_friction(random: Random, machine: Machine, part: str, law: str) -> Friction | None:
    """Friction of 5 to 40 times the noise; None where no sane one is as large."""
    times = float(np.exp(random.uniform(np.log(5), np.log(40))))
    heavy, light = max(machine.masses) * G, min(machine.masses) * G
    motor, cable = machine.highest
    shape = draw_shape(random, law, part, cable if part == "pulley" else motor)
    also = random.random() < 0.3 and part != "gear" and law != "saturating"
    if part == "motor":
        size = times * machine.noise["motor_torque"]
        viscosity = random.uniform(0.3, 1.5) * size / motor if also else 0.0
        return Friction(part, law, size, shape, viscosity)
    if part == "pulley":
        bend = sum(2 * np.sin(np.radians(wrap) / 2) for wrap in machine.winch.wraps)
        force = times * machine.noise["tension"]
        size = force / (light * bend)
        viscosity = random.uniform(0.3, 1.5) * force / cable if also else 0.0
        each = viscosity / len(machine.winch.wraps)
        return Friction(part, law, size, shape, each) if size < 0.15 else None
    torque = heavy * machine.winch.radius / machine.winch.ratio
    size = times * machine.noise["motor_torque"] / torque
    return Friction(part, law, size, shape) if size < 0.35 else None


def show_fine(winch: Winch, motor: Array, mass: float, frictions: Sequence[Friction]) -> Shown:
    """What ideal instruments show at every step."""

    def taken_up(angle: Array) -> Array:
        turned = winch.direction * (angle - winch.motor_reference) / winch.ratio
        total, start = TURN * winch.wound_turns + turned, np.array(TURN * winch.wound_turns)
        return wound_cable(winch, total, 0.0, 0.0) - wound_cable(winch, start, 0.0, 0.0)

    small = 1e-5
    arm = (taken_up(motor + small) - taken_up(motor - small)) / (2 * small)
    wound = taken_up(motor)
    rate, speed = np.gradient(motor, STEP), np.gradient(wound, STEP)
    load = mass * (G + np.gradient(speed, STEP))
    tension = load
    for f in frictions:
        if f.part == "pulley":
            way = f.size * sense(f.law, speed, STEP, f.shape)
            for wrap in reversed(winch.wraps):
                tension = bearing_friction(tension, way, np.radians(wrap)) + f.viscosity * speed
    torque = tension * arm
    for f in frictions:
        if f.part == "gear":
            # Winding in is against the load, paying out with it.
            way = sense(f.law, winch.direction * rate, STEP, f.shape)
            torque = torque * (1 - f.size) ** -way
    for f in frictions:
        if f.part == "motor":
            torque = torque + f.size * sense(f.law, rate, STEP, f.shape) + f.viscosity * rate
    return Shown(winch.length_reference - wound, tension, torque, load)
