"""Design equations of the winding-device paper (Eq. 10–18), with the corrections in docs/papers.md.

SI throughout; rad/s for speeds of rotation.
"""

from __future__ import annotations

from math import acos, hypot, pi, sin, sqrt

from winchkit.errors import UsageError

BUCKLES = {
    "supported-supported": pi,
    "fixed-supported": 3.926602,
    "fixed-fixed": 4.730041,
    "fixed-free": 1.875104,
}
"""First root of the bending vibration of a shaft, by the bearings at its ends."""
STANDARD_MODULES = (0.001, 0.0015, 0.002, 0.003, 0.004, 0.005, 0.007, 0.01)
"""Standard modules of toothed belts, m."""
_STEEL_SOUND = sqrt(2.06e11 / 7850.0)
"""Speed of sound along a steel bar, m/s."""
_RESERVE = 0.8
"""Highest share of the critical speed for a screw; part of makers' f = 21.9."""
_MODULE_FACTOR = 35e-3 * (60 / (2 * pi) * 1e3) ** (-1 / 3)
"""Eq. 17's 35 for m, W and rad/s in place of mm, kW and rpm."""


def transmission_efficiency(
    gearbox: float, belt: float, belts: float, bearing: float, bearings: float
) -> float:
    """Product of all parts (Eq. 10); the paper's 0.68 takes six bearings, not the printed two."""
    return float(gearbox * belt**belts * bearing**bearings)


def motor_power(force: float, speed: float, efficiency: float) -> float:
    """F v/η, W (Eq. 11)."""
    return force * speed / efficiency


def drum_turns(length: float, radius: float, pitch: float = 0.0) -> float:
    """Turns that ``length`` takes on a drum, on the helix of its groove (Eq. 12: pitch zero)."""
    return length / hypot(2 * pi * radius, pitch)


def motor_torque(force: float, radius: float, ratio: float, efficiency: float) -> float:
    """F R/(η u), N m (Eq. 13, first line)."""
    return force * radius / (efficiency * ratio)


def motor_speed(speed: float, radius: float, ratio: float) -> float:
    """v u/r, rad/s (Eq. 13, second line, with the circumference 2πr)."""
    return speed * ratio / radius


def critical_speed(diameter: float, length: float, ends: str) -> float:
    """Fastest safe speed of a steel screw, rad/s: 0.8 λ² (d/4) √(E/ρ)/L² (Eq. 16). Makers write n =
    f d/L² · 10⁷ in rpm and mm; fixed at both ends this is their f = 21.9."""
    return float(_RESERVE * BUCKLES[ends] ** 2 * diameter / 4 * _STEEL_SOUND / length**2)


def screw_diameter(speed: float, length: float, ends: str) -> float:
    """Core diameter whose safe speed is ``speed`` (rad/s), m: Eq. 16 solved, with L squared."""
    return speed / critical_speed(1.0, length, ends)


def belt_module(power: float, speed: float) -> float:
    """35 ∛(P/N) in mm, kW, rpm (Eq. 17), here m, W, rad/s: the least module of a toothed belt."""
    return float(_MODULE_FACTOR * (power / speed) ** (1 / 3))


def belt_length(distance: float, first: float, second: float) -> float:
    """Length of an open belt around two pulleys (pitch radii), exact, m. Raises UsageError."""
    if abs(first - second) >= distance:
        raise UsageError(
            f"belt pulleys of {first:g} m and {second:g} m lie within each other at a centre "
            f"distance of {distance:g} m; it must be above {abs(first - second):g} m"
        )
    lean = acos((second - first) / distance)
    return 2 * (distance * sin(lean) + first * lean + second * (pi - lean))


def centre_distance(length: float, first: float, second: float) -> float:
    """Shaft distance for a belt length (Eq. 18 with the squares of the radii corrected), m: A = ¼[L
    − π(R1 + R2) + √((L − π(R1 + R2))² − 8(R2 − R1)²)], to second order in (R2 − R1)/A. Raises
    UsageError for a belt too short."""
    straight = length - pi * (first + second)
    if straight < sqrt(8) * abs(second - first):
        raise UsageError(
            f"a belt of {length:g} m is too short for pulleys of {first:g} m and {second:g} m"
        )
    return (straight + sqrt(straight**2 - 8 * (second - first) ** 2)) / 4
