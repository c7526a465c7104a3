"""Newton-Euler mechanics of a rigid platform on elastic cables, integrated in time.

A cable is a Kelvin-Voigt spring of the unstrained length that its drum has paid out. Steps use the
implicit midpoint rule, linearised in the cable lengths: it is stable for the rotation of a light
platform on stiff cables (500 rad/s and more) in steps of 2.5 ms, and has no numerical damping.
Cable directions are those in the middle of a step; those at its beginning make slow oscillations
grow.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np

from winchkit.arrays import Array
from winchkit.sim.physics.state import GRAVITY
from winchkit.sim.robot.pulleys import Pulleys
from winchkit.sim.robot.rotation import turned

__all__ = ["Body", "CablePlatform"]

_STEP = 2.5e-3
_LEAST_STEP = 5e-5
"""Shorter times are left to the next call, s."""


@dataclass(frozen=True)
class Body:
    """Rigid body with n anchor points in its own frame."""

    mass: float
    center_of_mass: Array
    inertia: Array
    """About the centre of mass, body axes, (3, 3), kg m²."""
    anchor_point: Array
    """(n, 3), m."""


class CablePlatform:
    """The platform; n cables pull it.

    Parameters
    ----------
    body : Body
        Mass, inertia and anchor points.
    pulleys : Pulleys
        Where the cables come from.
    position : (3,) array
        Of the platform's origin at the start, at rest, m.
    attitude : (3, 3) array
        Platform to base.
    damping_time : float
        Ratio of damping to stiffness, s.
    """

    def __init__(
        self, body: Body, pulleys: Pulleys, position: Array, attitude: Array, damping_time: float
    ) -> None:
        self.body, self.pulleys = body, pulleys
        self.time = 0.0
        self.rotation = np.array(attitude, dtype=float)
        self.center = position + self.rotation @ body.center_of_mass
        self.velocity = np.zeros(6)
        """Of the centre of mass, and angular in the base frame, m/s and rad/s."""
        self.wrench = np.zeros(6)
        """External force and moment about the centre of mass beside the weight, N and N m."""
        self._arms = body.anchor_point - body.center_of_mass
        self._damping_time = damping_time
        self._inertia = np.zeros((6, 6))
        self._inertia[:3, :3] = body.mass * np.eye(3)
        self._weight = np.array([0.0, 0.0, -body.mass * GRAVITY, 0.0, 0.0, 0.0])
        self._locate()
        self.tension = np.zeros(len(body.anchor_point))
        """Cable forces at the platform, (n,), N."""
        self.speed = np.zeros(len(body.anchor_point))
        """Rates of the cable lengths, (n,), m/s."""

    @property
    def position(self) -> Array:
        """Of the platform's origin, (3,), m."""
        return np.asarray(self.center - self.rotation @ self.body.center_of_mass)

    @property
    def damping_time(self) -> float:
        """Ratio of damping to stiffness of the cables, s."""
        return self._damping_time

    def equilibrium(self, pretension: float) -> Array:
        """Cable forces at rest nearest to ``pretension``, (n,), N; negative where none exist."""
        wanted = np.full(len(self.tension), pretension)
        short = self._weight - self._jacobian.T @ wanted
        return np.asarray(wanted + np.linalg.lstsq(self._jacobian.T, short, rcond=None)[0])

    def unbalanced(self, tension: Array) -> Array:
        """Sum of weight and cable forces, (6,), N and N m."""
        return np.asarray(self._weight - self._jacobian.T @ tension)

    def advance(self, to: float, start: Array, end: Array, stiffness: Array) -> None:
        """Integrate until ``to``.

        Parameters
        ----------
        to : float
            s.
        start, end : (n,) arrays
            Unstrained cable lengths now and then, between which they change linearly, m.
        stiffness : (n,) array
            Of the cables, N/m.
        """
        duration = to - self.time
        if duration < _LEAST_STEP:
            return
        count = ceil(duration / _STEP - 1e-6)
        rate, dt = (end - start) / duration, duration / count
        for index in range(count):
            self._step(dt, start + rate * (dt * (index + 1)), rate, stiffness)
        self.time = to

    def _step(self, dt: float, unstrained: Array, rate: Array, stiffness: Array) -> None:
        velocity, center, rotation = self.velocity, self.center, self.rotation
        damping = stiffness * self._damping_time
        self._move(center, rotation, velocity * (dt / 2))
        jacobian, inertia = self._jacobian, self._inertia
        stretch = self.length - (unstrained - rate * (dt / 2))
        expected = stiffness * stretch + damping * (jacobian @ velocity - rate)
        taut = (stretch > 0) & (expected > 0)
        change = np.where(taut, dt / 4 * stiffness + damping / 2, 0.0)
        load = self._weight + self.wrench - jacobian.T @ np.where(taut, expected, 0.0)
        spin = velocity[None, 3:]
        load[3:] -= _cross(spin, spin @ inertia[3:, 3:])[0]
        matrix = inertia + dt * (jacobian.T * change) @ jacobian
        self.velocity = velocity + np.linalg.solve(matrix, dt * load)
        self._move(center, rotation, (velocity + self.velocity) * (dt / 2))
        self.speed = self._jacobian @ self.velocity
        stretch = self.length - unstrained
        pull = stiffness * stretch + damping * (self.speed - rate)
        self.tension = np.where(stretch > 0, np.maximum(pull, 0.0), 0.0)

    def _move(self, center: Array, rotation: Array, by: Array) -> None:
        """Pose at a displacement and a small rotation vector from another one."""
        self.center = center + by[:3]
        self.rotation = turned((float(by[3]), float(by[4]), float(by[5]))) @ rotation
        self._locate()

    def _locate(self) -> None:
        """Cables and inertia at the present pose."""
        arms = self._arms @ self.rotation.T
        self.length, direction, self.wrap = self.pulleys.cables(self.center + arms)
        self._jacobian = np.concatenate([direction, _cross(arms, direction)], axis=1)
        self._inertia[3:, 3:] = self.rotation @ self.body.inertia @ self.rotation.T


def _cross(a: Array, b: Array) -> Array:
    """Cross products of rows; a third of the time of ``numpy.cross`` for few of them."""
    return np.asarray(a[:, [1, 2, 0]] * b[:, [2, 0, 1]] - a[:, [2, 0, 1]] * b[:, [1, 2, 0]])
