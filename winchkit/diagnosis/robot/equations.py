"""What every pose of a robot must satisfy: model less measurement, by kind, in SI.

``rope`` is the rope by geometry less the rope by the drum; ``position``, ``rotation``, ``swivel``
and ``gauge`` (a length instrument at the rope) are what the pose says less what was measured;
``tension`` is what measured rope forces and the weight leave unbalanced, seen as rope forces.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.robot.dataset import RobotDataset
from winchkit.model.line import Line
from winchkit.model.robot import (
    Pose,
    Robot,
    angles_of,
    gravity_wrench,
    home_of,
    lengths,
    rotation_of,
    sensitivities,
    structure_matrix,
    swivel_angle,
    swivel_sensitivities,
)
from winchkit.model.robot.robot import standing
from winchkit.model.robot.rotation import angle_rates, rotation_by, rotation_vector
from winchkit.model.stages import At, Stage

__all__ = ["POSED", "Equations", "placed_by", "start_pose"]

Sigma = Mapping[str, float]
POSED = ("rope", "position", "rotation", "swivel", "gauge")
"""Kinds that change with the pose, in their order."""
_PLACING = 25
_STRIDE = 0.3
_SETTLED = 1e-9
_RIDGE = 1e-9
_SEEN = 1e-6
_INVERTING, _SMALL_FORCE, _FLATTEST = 8, 1e-4, 0.05


@dataclass(frozen=True)
class Equations:
    """The equations of a dataset's poses where the platform is taken to be."""

    dataset: RobotDataset
    pose: Pose
    basis: Robot
    """The robot by which forces are split into those that the weight knows and the others."""

    @cached_property
    def warm(self) -> Array:
        """Temperature of the ropes; 20 degrees Celsius where it was not measured."""
        temperature = self.dataset.measured.temperature
        return np.where(np.isfinite(temperature), temperature, 20.0)

    def forces(self, robot: Robot) -> Array:
        """Rope forces behind what the cells showed, (p, n), N; zero without cells."""
        shown = self.dataset.measured.tension
        if not self.dataset.has_tension:
            return np.zeros_like(shown)
        out = shown.copy()
        for i, line in enumerate(robot.lines):
            if any(m.stage is Stage.CELL for m in line.modifiers):
                angle = self.dataset.measured.motor_angle[:, i]
                at = standing(line, angle, shown[:, i], self.warm[:, i])
                out[:, i] = _behind(line, at, shown[:, i])
        return out

    def residuals(self, robot: Robot) -> dict[str, Array]:
        """By kind, (p, k), NaN where something was not measured."""
        measured, pose = self.dataset.measured, self.pose
        there = lengths(robot.geometry, pose.position, pose.rotation)
        force = self.forces(robot)
        by_drum = self._by_drum(robot, force)
        out = {
            "rope": there - by_drum,
            "position": pose.position - measured.position,
            "rotation": self._rotation,
            "swivel": self._swivel(robot),
            "gauge": there - measured.cable_length,
        }
        if self.dataset.has_balance:
            out["tension"] = self._unbalanced(robot, force)
        return out

    def _by_drum(self, robot: Robot, force: Array) -> Array:
        """Rope lengths that the motor angles stand for; what a bare winch winds is kept."""
        angle = self.dataset.measured.motor_angle
        out = np.empty_like(angle)
        for i, line in enumerate(robot.lines):
            winch = robot.profile.line[i].winch
            if line.modifiers:
                at = standing(line, angle[:, i], force[:, i], self.warm[:, i])
                out[:, i] = line.lengths(at)
                continue
            if i not in self._wound or self._wound[i][0] is not winch:
                length = line.lengths(standing(line, angle[:, i]))
                self._wound[i] = winch, length - robot.home_length[i]
            out[:, i] = robot.home_length[i] + self._wound[i][1]
        return out

    @cached_property
    def _wound(self) -> dict[int, tuple[object, Array]]:
        return {}

    def by_pose(self, robot: Robot) -> dict[str, Array]:
        """Derivatives by position and rotation vector, (p, k, 6)."""
        place, turn = self.pose.position, self.pose.rotation
        rope = sensitivities(robot.geometry, place, turn)
        swivel = swivel_sensitivities(robot.geometry, place, turn)
        by_rope, by_swivel = (
            np.concatenate([part.position, part.rotation], axis=-1) for part in (rope, swivel)
        )
        position, rotation = (np.zeros((len(place), 3, 6)) for _ in range(2))
        position[:, range(3), range(3)] = 1.0
        rotation[..., 3:] = angle_rates(turn)
        rotation[self._whole, :, 3:] = np.eye(3)
        kinds = (by_rope, position, rotation, by_swivel, by_rope)
        return dict(zip(POSED, kinds, strict=True))

    @cached_property
    def _whole(self) -> NDArray[np.bool_]:
        return np.asarray(np.all(np.isfinite(self.dataset.measured.angles), axis=1))

    @cached_property
    def _rotation(self) -> Array:
        """Whole rotations by their rotation vector, partial ones angle by angle."""
        angles, whole = self.dataset.measured.angles, self._whole
        out = _wrapped(angles_of(self.pose.rotation) - angles)
        seen = np.swapaxes(rotation_of(*angles[whole].T), 1, 2)
        out[whole] = rotation_vector(self.pose.rotation[whole] @ seen)
        return out

    def _swivel(self, robot: Robot) -> Array:
        shown = self.dataset.measured.swivel
        if not np.isfinite(shown).any():
            return shown
        there = swivel_angle(robot.geometry, self.pose.position, self.pose.rotation)
        return _wrapped(there - shown)

    @cached_property
    def _split(self) -> tuple[Array, Array]:
        """What turns a wrench left over into forces, one each of what the ropes can tell apart and
        as noisy as one cell, (p, k, 6), NaN where the ropes tell less; and these onto the ropes."""
        structure = structure_matrix(self.basis.geometry, self.pose.position, self.pose.rotation)
        good = np.all(np.isfinite(structure), axis=(1, 2))
        left, size, right = np.linalg.svd(
            np.where(good[:, None, None], structure, 0.0), full_matrices=False
        )
        seen = size > _SEEN * np.maximum(size[:, :1], 1e-300)
        inverse = np.where(seen, 1 / np.where(seen, size, 1.0), np.nan)
        forces = np.asarray(inverse[..., None] * np.swapaxes(left, 1, 2))
        return forces, np.asarray(np.swapaxes(right, 1, 2))

    @property
    def to_ropes(self) -> Array:
        """Unbalanced forces onto the ropes: the least change of their tensions, (p, n, k)."""
        return self._split[1]

    def _unbalanced(self, robot: Robot, force: Array) -> Array:
        """Forces that should carry the weight less those that do, (p, k), N."""
        structure = structure_matrix(robot.geometry, self.pose.position, self.pose.rotation)
        weight = gravity_wrench(robot.platform, self.pose.rotation)
        left = (structure @ force[..., None])[..., 0] + weight
        return np.asarray(-(self._split[0] @ left[..., None])[..., 0])


def start_pose(dataset: RobotDataset) -> Pose:
    """Measured positions and rotations, home's where there is none."""
    measured, home = dataset.measured, home_of(dataset.robot)
    position = np.where(np.isfinite(measured.position), measured.position, home.position)
    angles = np.where(np.isfinite(measured.angles), measured.angles, angles_of(home.rotation))
    return Pose(position, rotation_of(*angles.T))


def placed_by(equations: Equations, robot: Robot, sigma: Sigma) -> Pose:
    """The poses that fit best to everything measured there, with the robot as it is."""
    pose = equations.pose
    for _ in range(_PLACING):
        here = replace(equations, pose=pose)
        values, by = here.residuals(robot), here.by_pose(robot)
        rows, slope = [], []
        # The zeros of swivel angles and length instruments are unknown: they place nothing.
        for kind in ("rope", "position", "rotation"):
            known = np.isfinite(values[kind])
            rows.append(np.where(known, values[kind], 0.0) / sigma[kind])
            slope.append(np.where(known[..., None], by[kind], 0.0) / sigma[kind])
        residual, matrix = np.concatenate(rows, axis=1), np.concatenate(slope, axis=1)
        turned = np.swapaxes(matrix, 1, 2)
        normal = turned @ matrix
        scale = np.trace(normal, axis1=1, axis2=2)[:, None, None]
        normal = normal + _RIDGE * scale * np.eye(6)
        step = -np.linalg.solve(normal, turned @ residual[..., None])[..., 0]
        size = np.max(np.abs(step), axis=1, keepdims=True)
        step *= np.minimum(1.0, _STRIDE / np.maximum(size, _STRIDE))
        pose = Pose(pose.position + step[:, :3], rotation_by(step[:, 3:]) @ pose.rotation)
        if np.max(size) < _SETTLED:
            break
    return pose


def _behind(line: Line, at: At, shown: Array) -> Array:
    """The rope force that a cell shows as ``shown``, N: Newton's method, exact at once for a span.

    A cell at rest shows every force by itself, so derivatives are one difference for all.
    """
    force, size = shown.copy(), max(float(np.nanmax(np.abs(shown), initial=0.0)), 1.0)
    step = _SMALL_FORCE * size
    for _ in range(_INVERTING):
        here = line.shown_tension(at, force)
        missing = shown - here
        if np.nanmax(np.abs(missing), initial=0.0) < _SETTLED * size:
            break
        slope = (line.shown_tension(at, force + step) - here) / step
        force = force + missing / np.maximum(slope, _FLATTEST)
    return force


def _wrapped(angle: Array) -> Array:
    return np.asarray(np.remainder(angle + np.pi, 2 * np.pi) - np.pi)
