"""A machine as it is declared, its motion, and what an ideal one would show.

A winch lifts a mass over pulleys (drum, gear, cable); an axis turns an inertia. SI throughout.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Random = np.random.Generator

GRAVITY = 9.80665
FINE = 200.0
"""Steps of the physics, Hz; files have every fourth."""
EVERY = 4
PULLEY_RADIUS = 0.04


@dataclass(frozen=True)
class Machine:
    """Declared numbers; all that an entrant knows of the machine."""

    kind: str
    """``winch`` or ``axis``."""
    ratio: float
    """Motor turns per drum or joint turn."""
    inertia: float
    """About the motor's axis, kg m²; of an axis all that moves."""
    noise: dict[str, float]
    """Rms per output of the instruments, SI."""
    drum: str = ""
    """``grooved`` or ``archimedean``."""
    radius: float = 0.0
    """Axis to the middle of the cable, empty drum, m."""
    growth: float = 0.0
    """Grooved: pitch. Archimedean: growth of the radius per turn. m."""
    turns: float = 0.0
    """On the drum where the motor angle is zero."""
    length: float = 0.0
    """Free cable there, m."""
    dead_length: float = 0.0
    """Cable under tension that is not counted as free, m."""
    wraps: tuple[float, ...] = ()
    """Angle of wrap of each pulley, rad."""

    @property
    def outputs(self) -> tuple[str, ...]:
        """What its instruments measure."""
        return tuple(self.noise)

    def wound(self, drum: Array) -> Array:
        """Cable on the drum at a drum angle, m."""
        total = drum + 2 * pi * self.turns
        if self.drum == "grooved":  # a helix
            return np.hypot(self.radius, self.growth / (2 * pi)) * total
        return self.radius * total + self.growth * total**2 / (4 * pi)

    def arm(self, drum: Array) -> Array:
        """Derivative of the cable on the drum by the drum angle, m."""
        if self.drum == "grooved":
            return np.full_like(drum, np.hypot(self.radius, self.growth / (2 * pi)))
        return self.radius + self.growth * (drum + 2 * pi * self.turns) / (2 * pi)

    def declared(self) -> dict[str, object]:
        """For machine.json: SI, the unit in every name."""
        units = {"inertia": "kg m^2", "radius": "m", "growth": "m", "turns": "1", "wraps": "rad"}
        units |= {"length": "m", "dead_length": "m", "ratio": "1"}
        entry = {k: v for k, v in asdict(self).items() if self.kind == "winch" or k in AXIS_KEYS}
        noise = {f"{name} [{UNITS[name]}]": rms for name, rms in self.noise.items()}
        named = {f"{k} [{units[k]}]" if k in units else k: v for k, v in entry.items()}
        return named | {"noise": noise, "pulley_radius [m]": PULLEY_RADIUS, "inclination [deg]": 90}


AXIS_KEYS = ("kind", "ratio", "inertia", "noise")
UNITS = {
    "time": "s",
    "motor_angle": "rad",
    "cable_length": "m",
    "tension": "N",
    "motor_torque": "N m",
    "temperature": "degC",
}


@dataclass(frozen=True)
class Motion:
    """One run at fine steps; arrays (n,), of the motor."""

    time: Array
    angle: Array
    speed: Array
    acceleration: Array
    mass: float
    """On the cable, kg."""
    temperature: Array
    """°C."""
    programme: int


def draw_machine(random: Random, kind: str) -> tuple[Machine, tuple[float, ...]]:
    """A machine and the masses that are hung on it, kg (an axis: one, zero)."""
    ratio = float(random.choice([5.0, 10.0, 20.4, 33.3, 1.0]))
    if kind == "axis":
        inertia = 10 ** random.uniform(-4, -1.5)
        # The peak acceleration of the moves is of the order of 50 rad/s².
        noise = {"motor_torque": round(inertia * random.uniform(0.2, 1.0), 9)}
        return Machine("axis", ratio, round(inertia, 6), noise), (0.0,)
    radius = random.uniform(0.03, 0.1)
    drum = str(random.choice(["grooved", "archimedean"]))
    growth = random.uniform(2e-3, 6e-3) if drum == "grooved" else random.uniform(1e-4, 2e-3)
    heaviest = random.uniform(15, 60)
    masses = tuple(round(float(heaviest * part), 2) for part in (1.0, 0.4, 0.65))
    torque = heaviest * GRAVITY * radius / ratio
    noise = {
        "cable_length": round(random.uniform(5e-5, 3e-4), 6),
        "tension": round(random.uniform(0.2, 1.5), 3),
        "motor_torque": round(torque * random.uniform(0.003, 0.01), 7),
    }
    machine = Machine(
        kind="winch",
        ratio=ratio,
        inertia=round(float(0.02 * torque / ratio * random.uniform(0.1, 1.0)), 8),
        noise=noise,
        drum=drum,
        radius=round(radius, 4),
        growth=round(growth, 6),
        turns=round(random.uniform(4, 9), 1),
        length=round(random.uniform(3, 8), 2),
        dead_length=round(random.uniform(0.3, 2), 2) if random.random() < 0.6 else 0.0,
        wraps=tuple(round(random.uniform(0.6, pi), 3) for _ in range(random.integers(1, 4))),
    )
    return machine, masses


def draw_place(random: Random, machine: Machine, seconds: float) -> Array:
    """Motor angle of a programme, rad: moves between random places at four speeds, with holds.

    A trapezoidal speed, averaged twice over 0.4 s: acceleration and jerk are bounded.
    """
    if machine.kind == "axis":
        stroke = 2.5 * pi * min(machine.ratio, 5.0)
    else:
        cable = min(random.uniform(1.0, 4.0), 0.8 * 2 * pi * machine.turns * machine.radius)
        stroke = cable / machine.radius * machine.ratio
    speed, place, at = np.zeros(round(seconds * FINE)), 0.0, round(FINE * 1.5)
    speeds = stroke / np.array([2.0, 4.0, 8.0, 20.0])
    while at < len(speed):
        goal = -stroke * random.uniform(0, 1)
        if abs(goal - place) < 0.25 * stroke:
            goal = -stroke if place > -stroke / 2 else 0.0
        count = max(2, round(abs(goal - place) / float(random.choice(speeds)) * FINE))
        speed[at : at + count] = (goal - place) / count * FINE
        place += float(np.sum(speed[at : at + count])) / FINE
        at += count + round(FINE * float(random.choice([0.5, 1.0, 2.0])))
    window = np.ones(round(0.4 * FINE)) / round(0.4 * FINE)
    for _ in range(2):
        speed = np.convolve(speed, window, mode="same")
    return np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2)]) / FINE


def motion(angle: Array, mass: float, temperature: Array, programme: int) -> Motion:
    """A run that follows a motor angle at fine steps."""
    speed = np.gradient(angle, 1 / FINE)
    return Motion(
        time=np.arange(len(angle)) / FINE,
        angle=angle,
        speed=speed,
        acceleration=np.gradient(speed, 1 / FINE),
        mass=mass,
        temperature=temperature,
        programme=programme,
    )
