"""Constraint equations of a cable robot's poses, with every first derivative.

At a pose with position c and rotation R each cable gives one closure equation, and every further
instrument its own rows; a residual is model less measurement, in SI. The pose is unknown.

``closure`` (CABTIVE paper, Eq. 1 to 3). Geometric length L with the arc on the swivel pulley
against the length by the drum, with the home pose c₀, R₀, the strain ε against home, the stressed
dead length d between drum and exit point, an offset h of the home length, and the cable ΔW that the
drum winds in from home to the drum angle φ:

    r = L(c, R) − ε (L(c, R) + d) − [L(c₀, R₀) + h − ΔW(φ)]

Derivatives by rotation are those by a rotation vector ω in the base frame, R' = exp([ω]×) R. Those
of a rotation vector between two rotations are exact at a residual of zero.

The balance of forces at the platform is in :mod:`winchkit.robot.forces.balance`.

References
----------
CABTIVE paper: S. Lessanibahri, H. Chanal, C. Bouzgarrou, M. Gouttefarde, *Geometric Calibration of
an Over-Constrained CDPR using Partial End-Effector Pose Measurement*.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from winchkit.arrays import Array
from winchkit.model.drum import Archimedean, Grooved, Spiral, Squared, drum_of
from winchkit.model.rotation import angle_rates, angles_of, rotation_of, rotation_vector
from winchkit.robot.geometry.kinematics import (
    Geometry,
    Pose,
    Sensitivities,
    by_pose,
    linearised,
    sensitivities,
    swivel_angle,
    swivel_sensitivities,
)
from winchkit.schema.profiles.winch import WinchProfile

_TURN = 2 * np.pi

ZERO_STD = {"swivel": 0.2, "cable_length": 0.05}
"""Standard deviation of the prior of an instrument's zero about its mean reading, rad and m (rule
of thumb: wider than any zero that is left after the mean)."""


@dataclass(frozen=True)
class Constraint:
    """Equations of one kind at p poses."""

    residual: Array
    """Model less measurement, (p, k), SI; NaN where nothing was measured."""
    by_pose: Array
    """Derivative by position and rotation vector, (p, k, 6)."""
    by_line: Mapping[str, Array] = field(default_factory=dict)
    """Derivatives of each line's row by the line's own numbers: (p, n, 3) for points, (p, n)."""
    by_robot: Mapping[str, Array] = field(default_factory=dict)
    """Derivatives by numbers that all lines share, (p, k, m)."""


@dataclass(frozen=True)
class Winding:
    """Cable wound in since home, ΔW = √(r² + lead²) Δφ + g gain + rest, for every winding law."""

    turned: Array
    """Drum angle since home Δφ, (p, n), rad."""
    gain: Array
    """∂ΔW/∂g, turns, (p, n); zero where a drum has no layers."""
    rest: Array
    """Part of ΔW that neither radius nor growth changes, (p, n), m."""
    lead: Array
    """Groove pitch over 2π, (n,), m/rad."""

    def wound(self, radius: Array, growth: Array | float) -> Array:
        """Cable wound in since home, (p, n), m."""
        return np.hypot(radius, self.lead) * self.turned + growth * self.gain + self.rest

    def by_radius(self, radius: Array) -> Array:
        """Derivative of :meth:`wound` by each line's radius r, (p, n); at r = 0 without grooves its
        limit from above."""
        turn = np.hypot(radius, self.lead)
        share = np.divide(radius, turn, out=np.ones_like(turn), where=turn > 0)
        return np.asarray(share * self.turned)


@dataclass(frozen=True)
class Strain:
    """Strains of the cables at p poses and their derivatives."""

    value: Array
    """(p, n)."""
    by_robot: Mapping[str, Array]
    """Derivatives by numbers that all lines share, (p, n, m)."""


def winding_of(winches: Sequence[WinchProfile], motor_angle: Array) -> Winding:
    """Separate the winding laws of a robot's drums into the terms of :class:`Winding`."""
    turned, gain, rest = (np.zeros_like(motor_angle) for _ in range(3))
    lead = np.zeros(len(winches))
    for i, winch in enumerate(winches):
        ratio = winch.gearbox.direction * winch.gearbox.ratio
        home = np.asarray(_TURN * winch.reference.wound_turns)
        turned[:, i] = (motor_angle[:, i] - winch.reference.motor_angle) / ratio
        angle = home + turned[:, i]
        match drum_of(winch):
            case Spiral():
                unit: Spiral | Archimedean = Spiral(0.0, 1.0)
                gain[:, i] = unit.wound(angle) - unit.wound(home)
            case Archimedean():
                unit = Archimedean(0.0, 1.0)
                gain[:, i] = unit.wound(angle) - unit.wound(home)
            case Squared(_, build_up):
                unit = Archimedean(0.0, np.pi * build_up)
                rest[:, i] = unit.wound(angle) - unit.wound(home)
            case Grooved(_, pitch):
                lead[i] = pitch / _TURN
    return Winding(turned, gain, rest, lead)


def closure_residual(
    length: Array, by_drum: Array, strain: Array | float = 0.0, dead_length: Array | float = 0.0
) -> Array:
    """Residuals of the closure equations."""
    return np.asarray(length - strain * (length + dead_length) - by_drum)


def closure(
    geometry: Geometry,
    pose: Pose,
    home: Pose,
    by_drum: Array,
    *,
    winding: Winding,
    radius: Array,
    strain: Strain | None = None,
    dead_length: Array | float = 0.0,
) -> Constraint:
    """Closure equations, by pose, each line's geometry and drum, ``layer_growth`` and what the
    strain depends on; ``by_drum``: unstrained lengths by the drums, (p, n), m."""
    length, by = linearised(geometry, pose.position, pose.rotation)
    at_home = sensitivities(geometry, home.position, home.rotation)
    taken = 0.0 if strain is None else strain.value
    slack = np.asarray(1 - taken + np.zeros_like(length))
    by_line = {
        "exit_point": by.exit_point * slack[..., None] - at_home.exit_point,
        "anchor_point": by.anchor_point * slack[..., None] - at_home.anchor_point,
        "swivel_radius": by.swivel_radius * slack - at_home.swivel_radius,
        "winding_radius": winding.by_radius(radius),
        "home_length": np.full_like(slack, -1.0),
    }
    by_robot = {"layer_growth": winding.gain[..., None]}
    if strain is not None:
        stressed = (length + dead_length)[..., None]
        by_robot |= {name: -part * stressed for name, part in strain.by_robot.items()}
    residual = closure_residual(length, by_drum, taken, dead_length)
    return Constraint(residual, by_pose(by) * slack[..., None], by_line, by_robot)


def position(pose: Pose, measured: Array) -> Constraint:
    """Position of the platform less the measured one, (p, 3), m."""
    by = np.zeros((len(measured), 3, 6))
    by[:, range(3), range(3)] = 1.0
    return Constraint(pose.position - measured, by)


def rotation(pose: Pose, angles: Array) -> Constraint:
    """Rotation of the platform less the measured one, (p, 3), rad."""
    by = np.zeros((len(angles), 3, 6))
    by[..., 3:] = angle_rates(pose.rotation)
    by[np.all(np.isfinite(angles), axis=1), :, 3:] = np.eye(3)
    return Constraint(rotation_residual(pose.rotation, angles), by)


def rotation_residual(turned: Array, angles: Array) -> Array:
    """Rotation vector where all three angles were measured, else angle by angle; (p, 3), rad."""
    whole = np.all(np.isfinite(angles), axis=1)
    out = wrapped(angles_of(turned) - angles)
    seen = np.swapaxes(rotation_of(*angles[whole].T), 1, 2)
    out[whole] = rotation_vector(turned[whole] @ seen)
    return out


def swivel_residual(
    geometry: Geometry, pose: Pose, measured: Array, zero: Array | float = 0.0
) -> Array:
    """Angles of the swivel pulleys plus their instruments' zeros less readings, (p, n), rad."""
    return wrapped(swivel_angle(geometry, pose.position, pose.rotation) + zero - measured)


def swivel(
    geometry: Geometry, pose: Pose, measured: Array, zero: Array | float = 0.0
) -> Constraint:
    """:func:`swivel_residual` with derivatives by pose, geometry and ``swivel_zero``."""
    by = swivel_sensitivities(geometry, pose.position, pose.rotation)
    by_line = {**by_geometry(by), "swivel_zero": np.ones_like(measured)}
    return Constraint(swivel_residual(geometry, pose, measured, zero), by_pose(by), by_line)


def cable_length(
    geometry: Geometry, pose: Pose, measured: Array, offset: Array | float = 0.0
) -> Constraint:
    """Geometric lengths plus offsets of their instruments less readings, (p, n), m."""
    length, by = linearised(geometry, pose.position, pose.rotation)
    by_line = {**by_geometry(by), "length_offset": np.ones_like(measured)}
    return Constraint(length + offset - measured, by_pose(by), by_line)


def mean_offset(residual: Array, *, angles: bool) -> Array:
    """Offset of each line's instrument that makes its mean residual zero, (n,); zero without
    measurements. The mean of ``angles``, rad, is the circular one."""
    known = np.isfinite(residual)
    values = np.where(known, residual, 0.0)
    if angles:
        return np.asarray(-np.angle(np.where(known, np.exp(1j * values), 0.0).sum(axis=0)))
    return np.asarray(-values.sum(axis=0) / np.maximum(known.sum(axis=0), 1))


def wrapped(angle: Array) -> Array:
    """Angles within −π and π, rad."""
    return np.asarray(np.remainder(angle + np.pi, 2 * np.pi) - np.pi)


def by_geometry(by: Sensitivities) -> dict[str, Array]:
    """Derivatives by each line's own points and swivel radius, by name."""
    return {
        "exit_point": by.exit_point,
        "anchor_point": by.anchor_point,
        "swivel_radius": by.swivel_radius,
    }
