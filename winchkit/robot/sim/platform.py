"""A rigid platform on elastic cables, integrated in time.

A cable is a Kelvin-Voigt spring of the unstrained length that its drum has paid out. Steps use the
implicit midpoint rule, linearised in the cable lengths: it is stable for the rotation of a light
platform on stiff cables (500 rad/s and more) in steps of 2.5 ms, and has no numerical damping.
Cable directions are those in the middle of a step; those at its beginning make slow oscillations
grow.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.robot.sim.mechanics import CABLE, ROW, WORK, cables, compiled_step, step
from winchkit.units import GRAVITY

_STEP = 2.5e-3
"""s: a fortieth of the period of a platform on stiff cables (10 Hz); rule of thumb, the rule is
stable with any step."""
_LEAST_STEP = 5e-5
"""Shorter times are left to the next call, s."""


@dataclass(frozen=True)
class RigidBody:
    """Rigid body with n anchor points in its own frame."""

    mass: float
    center_of_mass: Array
    inertia: Array
    """About the centre of mass, body axes, (3, 3), kg m²."""
    anchor_point: Array
    """(n, 3), m."""
    free: tuple[float, ...] = (1.0,) * 6
    """1 for each coordinate in base axes in which it moves, 0 where guides hold it."""


@dataclass(frozen=True)
class Pulleys:
    """Exit points and swivelling pulleys of n cables."""

    exit_point: Array
    """(n, 3), m."""
    axis: Array
    """Unit vectors, (n, 3)."""
    radius: Array
    """(n,), m; zero for a fixed exit point."""


class CablePlatform:
    """The platform, pulled by n cables, at rest at ``position`` (3,), m; ``compiled`` by numba,
    which takes seconds; ImportError where it is not installed."""

    def __init__(
        self,
        body: RigidBody,
        pulleys: Pulleys,
        position: Array,
        attitude: Array,
        damping_time: float,
        *,
        compiled: bool = False,
    ) -> None:
        self.body, self.pulleys = body, pulleys
        self.time = 0.0
        self.damping_time = damping_time
        """Ratio of damping to stiffness of the cables, s."""
        self.wrench = np.zeros(6)
        """External force and moment about the centre of mass beside the weight, N and N m."""
        self._weight = np.array([0.0, 0.0, -body.mass * GRAVITY, 0.0, 0.0, 0.0]) * body.free
        count = len(body.anchor_point)
        arms = body.anchor_point - body.center_of_mass
        lines = np.column_stack([pulleys.exit_point, pulleys.axis, pulleys.radius, arms])
        self._step: Callable[..., None] = compiled_step() if compiled else step
        floats = self._floats = np.array if compiled else _plain
        self._lines, self._body = (
            floats(lines.ravel()),
            floats([body.mass, *body.inertia.flat, *body.free]),
        )
        self._center = floats(position + attitude @ body.center_of_mass)
        self._rotation = floats(np.asarray(attitude, dtype=float).ravel())
        self._velocity = floats(np.zeros(6))
        self._rows, self._forces = floats(np.zeros(ROW * count)), floats(np.zeros(2 * count))
        self._springs, self._work = floats(np.zeros(3 * count)), floats(np.zeros(WORK))
        cables(self._lines, self._center, self._rotation, self._rows)
        if compiled:
            self._advance(0.0, self._floats(self._weight))  # compiles it
        self.cable = self._cable_states()
        """Length (m), its rate (m/s) and wrap (rad) of each cable."""

    @property
    def count(self) -> int:
        """Number of cables."""
        return len(self._lines) // CABLE

    @property
    def center(self) -> Array:
        """Centre of mass, (3,), m."""
        return np.array(self._center)

    @property
    def rotation(self) -> Array:
        """Platform to base, (3, 3)."""
        return np.array(self._rotation).reshape(3, 3)

    @property
    def position(self) -> Array:
        """Of the platform's origin, (3,), m."""
        return np.asarray(self.center - self.rotation @ self.body.center_of_mass)

    @property
    def velocity(self) -> Array:
        """Of the centre of mass, and angular in the base frame, (6,), m/s and rad/s."""
        return np.array(self._velocity)

    @velocity.setter
    def velocity(self, velocity: Array) -> None:
        self._velocity = self._floats(velocity)

    @property
    def length(self) -> Array:
        """Of the cables from pulley to anchor, arc included, (n,), m."""
        return np.array(self._rows[0::ROW])

    @property
    def wrap(self) -> Array:
        """Of the cables on their pulleys, (n,), rad."""
        return np.array(self._rows[7::ROW])

    @property
    def tension(self) -> Array:
        """Cable forces at the platform, (n,), N."""
        return np.array(self._forces[0::2])

    @tension.setter
    def tension(self, tension: Array) -> None:
        self._forces[0::2] = self._floats(tension)

    @property
    def speed(self) -> Array:
        """Rates of the cable lengths, (n,), m/s."""
        return np.array(self._forces[1::2])

    def _cable_states(self) -> list[tuple[float, float, float]]:
        # Plain floats: arithmetic with those of NumPy takes four times as long.
        rows, forces = (
            values.tolist() if isinstance(values, np.ndarray) else values
            for values in (self._rows, self._forces)
        )
        return list(zip(rows[0::ROW], forces[1::2], rows[7::ROW], strict=True))

    def equilibrium(self, pretension: float) -> Array:
        """Cable forces at rest nearest to ``pretension``, (n,), N; negative where none exist."""
        wanted = np.full(self.count, pretension)
        return np.asarray(
            wanted + np.linalg.lstsq(self._jacobian.T, self.unbalanced(wanted), rcond=None)[0]
        )

    def unbalanced(self, tension: Array) -> Array:
        """Sum of weight and cable forces, (6,), N and N m."""
        return np.asarray(self._weight - self._jacobian.T @ tension)

    @property
    def _jacobian(self) -> Array:
        """Gradient of the cable lengths by the motions of the centre of mass, (n, 6)."""
        return np.array(self._rows).reshape(-1, ROW)[:, 1:7] * self.body.free

    def advance(
        self, to: float, start: Sequence[float], end: Sequence[float], stiffness: Sequence[float]
    ) -> None:
        """Integrate until ``to``, s; unstrained cable lengths (n,), m, change linearly from
        ``start`` to ``end``."""
        duration = to - self.time
        if duration < _LEAST_STEP:
            return
        count = ceil(duration / _STEP - 1e-6)
        dt, springs = duration / count, self._springs
        springs[1::3] = [(b - a) / duration for a, b in zip(start, end, strict=True)]
        springs[2::3] = self._floats(stiffness)
        load = self._floats(self._weight + self.wrench)
        for index in range(count):
            share = (index + 1) / count
            springs[0::3] = [a + (b - a) * share for a, b in zip(start, end, strict=True)]
            self._advance(dt, load)
        self.time = to
        self.cable = self._cable_states()

    def _advance(self, dt: float, load: Any) -> None:
        """Make one step of ``dt`` s under an external load (6,)."""
        self._step(
            dt,
            self.damping_time,
            self._lines,
            self._body,
            load,
            self._springs,
            self._center,
            self._rotation,
            self._velocity,
            self._rows,
            self._forces,
            self._work,
        )


def _plain(values: Any) -> list[float]:
    """Floats of a sequence or an array of one dimension."""
    return [float(value) for value in values]
