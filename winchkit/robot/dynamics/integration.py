"""Motion of the platform on elastic cables under given motor angles: the forward dynamics in time.

A cable is a Kelvin-Voigt spring between the length L0 that the winch has paid out and the length L
that the pose needs, and carries no pressure:

    f = max(0, EA/(L0 + d) (L − L0) + D (dL/dt − dL0/dt)),      D = T EA/(L0 + d)

with the dead length d and the damping time T. The rotation of a light platform on stiff cables is
faster than its motion by orders of magnitude, so that the equations are stiff: they are integrated
by an implicit Runge-Kutta method of order 5 (Radau IIA, Hairer and Wanner, *Solving Ordinary
Differential Equations II*, 1996, IV.8), which stays stable at any step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.model.rotation import quaternion_of, rotation_from_quaternion
from winchkit.robot.dynamics.dynamics import accelerations
from winchkit.robot.geometry.kinematics import Geometry, Pose, lengths, structure_matrix
from winchkit.schema.profiles.robot import PlatformSpec


@dataclass(frozen=True)
class ElasticCables:
    """Stiffness and damping of n cables."""

    axial_stiffness: Array
    """EA, (n,), N."""
    dead_length: Array
    """Stressed cable between drum and exit point, (n,), m."""
    damping_time: float = 0.0
    """T, ratio of damping to stiffness, s."""


@dataclass(frozen=True)
class SimulatedPlatform:
    """The platform at k instants."""

    time: Array
    """(k,), s."""
    pose: Pose
    """k poses."""
    velocity: Array
    """Of the origin, and angular, base axes, (k, 6), m/s and rad/s."""
    force: Array
    """Cable forces, (k, n), N."""


def cable_forces(
    geometry: Geometry,
    cables: ElasticCables,
    pose: Pose,
    velocity: Array,
    unstrained: Array,
    *,
    rate: Array | float = 0.0,
) -> Array:
    """Forces of elastic cables, (p, n), N, zero where slack, at lengths without force (n,) or (p,
    n), m, and their rates, m/s."""
    there = lengths(geometry, pose.position, pose.rotation)
    stiffness = cables.axial_stiffness / (unstrained + cables.dead_length)
    pull = stiffness * (there - unstrained)
    if cables.damping_time:
        structure = structure_matrix(geometry, pose.position, pose.rotation)
        speed = -np.einsum("kij,ki->kj", structure, velocity) - rate
        pull = pull + np.where(there > unstrained, cables.damping_time * stiffness * speed, 0.0)
    return np.maximum(pull, 0.0)


def integrate(
    geometry: Geometry,
    platform: PlatformSpec,
    cables: ElasticCables,
    start: tuple[Pose, Array],
    *,
    unstrained: Callable[[float], Array],
    rate: Callable[[float], Array] | None = None,
    time: Array,
    tolerance: float = 1e-8,
) -> SimulatedPlatform:
    """Integrate the platform's motion from one pose and its velocity (6,); the result has the k
    instants of ``time``. ``unstrained`` lengths (n,) at a time, m, are those of
    ``robot.lengths_at``, their ``rate`` is for the damping. Raises UsageError without mass or
    moment of inertia, or where the integration does not reach the end."""
    from scipy.integrate import solve_ivp

    pose, velocity = start

    def paid(now: float) -> Array:
        return np.zeros(len(geometry.exit_point)) if rate is None else rate(now)

    def placed(state: Array) -> tuple[Pose, Array]:
        rows = np.atleast_2d(state)
        return Pose(rows[:, :3], rotation_from_quaternion(rows[:, 3:7])), rows[:, 7:]

    def slope(now: float, state: Array) -> Array:
        at, moving = placed(state)
        force = cable_forces(geometry, cables, at, moving, unstrained(now), rate=paid(now))
        structure = structure_matrix(geometry, at.position, at.rotation)
        wrench = (structure @ force[..., None])[..., 0]
        gained = accelerations(platform, at.rotation, moving, wrench)[0]
        spin, (w, *axis) = moving[0, 3:], state[3:7]
        # Quaternion rate ½ (0, ω) q of an angular velocity in base axes.
        turning = np.concatenate([[-spin @ axis], w * spin + np.cross(spin, axis)]) / 2
        return np.concatenate([moving[0, :3], turning, gained])

    begin = np.concatenate([pose.position[0], quaternion_of(pose.rotation)[0], velocity])
    found = solve_ivp(
        slope,
        (float(time[0]), float(time[-1])),
        begin,
        method="Radau",
        t_eval=time,
        rtol=tolerance,
        atol=tolerance,
    )
    if not found.success:
        raise UsageError(f"the platform's motion could not be integrated: {found.message}")
    there, moving = placed(found.y.T)
    rest, rates = (np.array([given(float(now)) for now in time]) for given in (unstrained, paid))
    force = cable_forces(geometry, cables, there, moving, rest, rate=rates)
    return SimulatedPlatform(np.asarray(found.t), there, moving, force)
