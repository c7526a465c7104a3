"""Constraint equations of a robot's poses for robots with effects, at poses that are held.

The equations and their derivatives are those of :mod:`winchkit.robot.geometry.constraints`, and the
residuals are model less measurement by kind, in SI. Here

* ``closure`` is the closure equation with the effects of the catalogue in the length by the drum,
  which is the length under load; the calibration has the unstrained length, so that its residual
  is smaller by the factor 1 − ε;
* lengths by the drum are those of :class:`winchkit.model.line.Line`, which applies effects; without
  effects they are those of :class:`winchkit.robot.geometry.constraints.Winding` up to rounding;
* ``statics`` is the equilibrium of a hanging platform
  (:mod:`winchkit.robot.forces.balance`), which takes part in its pose; its ``tension`` rows,
  the part of it that cable forces can carry, are then shown alone;
* ``gauge`` are the rows ``cable_length`` and ``tension`` the rows ``balance`` of that module;
* ``tension`` rows are whitened at the pose and geometry of one robot (``basis``), so that they
  stay comparable between hypotheses, and cable forces are computed from the cells' readings;
* zeros of swivel angles and offsets of length instruments are no part of the residuals; the
  regression has them as nuisance parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from winchkit.arrays import Array
from winchkit.model.line import Line
from winchkit.model.stages import At, Stage
from winchkit.robot.diagnosis.data.dataset import RobotDataset
from winchkit.robot.diagnosis.prior import GeometryPrior
from winchkit.robot.forces.balance import (
    force_basis,
    hanging_balance,
    hanging_residual,
    wrench_residual,
)
from winchkit.robot.geometry.constraints import (
    Constraint,
    by_geometry,
    by_pose,
    closure_by_geometry,
    closure_residual,
    position,
    rotation_by_pose,
    rotation_residual,
    swivel_residual,
    winding_of,
)
from winchkit.robot.geometry.kinematics import (
    Pose,
    home_of,
    lengths,
    sensitivities,
    structure_matrix,
    swivel_sensitivities,
)
from winchkit.robot.geometry.pose_estimation import moved_pose
from winchkit.robot.geometry.pose_estimation import start_pose as completed
from winchkit.robot.geometry.robot import Robot, standing
from winchkit.robot.geometry.tracker import (
    Tracker,
    tracked_position,
    tracked_rotation,
)
from winchkit.robot.geometry.wrench import gravity_wrench

POSED = ("closure", "position", "rotation", "swivel", "gauge", "statics")
"""Kinds that depend on the pose, in their order."""
_NEWTON_STEPS, _FORCE_STEP, _LEAST_SLOPE, _FORCE_TOLERANCE = 8, 1e-4, 0.05, 1e-9
"""_NEWTON_STEPS: Newton steps from a cell's reading to a force; numerical. _FORCE_STEP: Step of a
derivative by the force, over the largest force; numerical. _LEAST_SLOPE: Smallest slope of a cell
that is divided by; numerical. _FORCE_TOLERANCE: Relative tolerance at which an inverted length is
taken as found; numerical."""


@dataclass(frozen=True)
class Equations:
    """Constraint equations of a dataset at given poses."""

    dataset: RobotDataset
    pose: Pose
    basis: Robot
    """Robot at whose structure matrices the wrenches are whitened."""

    @cached_property
    def temperature(self) -> Array:
        """Of the cables, (p, n), degrees Celsius; 20 where it was not measured."""
        temperature = self.dataset.measured.temperature
        return np.where(np.isfinite(temperature), temperature, 20.0)

    def forces(self, robot: Robot) -> Array:
        """Cable forces behind the cells' readings, (p, n), N; zero without cells."""
        shown = self.dataset.measured.tension
        if not self.dataset.has_tension:
            return np.zeros_like(shown)
        out = shown.copy()
        for i, line in enumerate(robot.lines):
            if any(m.stage in (Stage.CELL, Stage.PULLEY) for m in line.modifiers):
                for rows in self._stretches:
                    own = shown[rows, i]
                    out[rows, i] = _force_behind(line, self._at(line, i, own, rows), own)
        return out

    @property
    def _stretches(self) -> tuple[slice, ...]:
        """Rows in time that follow one another: those of each run of a trajectory."""
        trajectory = self.dataset.trajectory
        return (slice(None),) if trajectory is None else trajectory.runs

    def _at(self, line: Line, index: int, force: Array, rows: slice = slice(None)) -> At:
        """Inputs of the modifiers of a line, at rest or in motion."""
        angle = self.dataset.measured.motor_angle[rows, index]
        temperature, trajectory = self.temperature[rows, index], self.dataset.trajectory
        if trajectory is None:
            return standing(line, angle, force, temperature)
        rate = trajectory.motor_rate[rows, index]
        return line.moments(trajectory.time[rows], angle, rate, force, temperature)

    def residuals(self, robot: Robot) -> dict[str, Array]:
        """Residuals by kind of a robot with its effects.

        ``robot``: of n lines. Returns: (p, k) each, m, rad or N; NaN where something was not
        measured.
        """
        measured, pose = self.dataset.measured, self.pose
        length = lengths(robot.geometry, pose.position, pose.rotation)
        force = self.forces(robot)
        out = {
            "closure": closure_residual(length, self._by_drum(robot, force)),
            "position": self._position(robot),
            "rotation": self._rotation(robot),
            "swivel": self._swivel(robot),
            "gauge": length - measured.cable_length,
            "statics": np.full((len(measured), 6), np.nan),
        }
        if self.dataset.hangs:
            out["statics"] = hanging_residual(
                robot.geometry, pose, force, robot.platform, self._inertial(robot)
            )
        if self.dataset.has_balance:
            out["tension"] = self._balance(robot, force)
        return out

    def _by_drum(self, robot: Robot, force: Array) -> Array:
        """Cable lengths by motor angles, home pose and effects, (p, n), m."""
        angle = self.dataset.measured.motor_angle
        out = np.empty_like(angle)
        for i, line in enumerate(robot.lines):
            if line.modifiers:
                out[:, i] = line.lengths(self._at(line, i, force[:, i]))
            else:
                out[:, i] = robot.home_length[i] + self._paid_out(robot, i, line)
        return out

    def _paid_out(self, robot: Robot, index: int, line: Line) -> Array:
        """Cable paid out since home by a drum without effects, (p,), m; kept per winch profile."""
        winch = robot.profile.line[index].winch
        if index not in self._kept or self._kept[index][0] is not winch:
            length = line.lengths(standing(line, self.dataset.measured.motor_angle[:, index]))
            self._kept[index] = winch, length - robot.home_length[index]
        return self._kept[index][1]

    @cached_property
    def _kept(self) -> dict[int, tuple[object, Array]]:
        return {}

    def by_pose(self, robot: Robot) -> dict[str, Array]:
        """Derivatives of the residuals by position and rotation vector, (p, k, 6), by kind."""
        pose, measured = self.pose, self.dataset.measured
        length = by_pose(sensitivities(robot.geometry, pose.position, pose.rotation))
        swivel = by_pose(swivel_sensitivities(robot.geometry, pose.position, pose.rotation))
        if robot.tracker is None:
            place = position(pose, measured.position).by_pose
            turned = rotation_by_pose(pose.rotation, measured.angles)
        else:
            seen = self._seen(robot.tracker)
            place = tracked_position(robot.tracker, seen, measured.position).by_pose
            turned = tracked_rotation(robot.tracker, seen, measured.angles).by_pose
        statics = np.zeros((len(measured), 6, 6))
        if self.dataset.hangs:
            statics = self._statics(robot).by_pose
        return {
            "closure": length,
            "position": place * robot.geometry.free,
            "rotation": turned * robot.geometry.free,
            "swivel": swivel,
            "gauge": length,
            "statics": statics,
        }

    def _statics(self, robot: Robot) -> Constraint:
        return hanging_balance(
            robot.geometry, self.pose, self.forces(robot), robot.platform, self._inertial(robot)
        )

    def _inertial(self, robot: Robot) -> Array | float:
        """Wrench of the platform's inertial forces, (p, 6), N and N m; zero at rest."""
        trajectory = self.dataset.trajectory
        return 0.0 if trajectory is None else trajectory.inertial_wrench(robot.platform)

    def _seen(self, tracker: Tracker) -> Pose:
        """Poses that a tracker shows, which are those of its delay before."""
        if self.dataset.trajectory is None or not tracker.delay:
            return self.pose
        return moved_pose(self.pose, self.dataset.trajectory.earlier(tracker.delay))

    def by_geometry(self, robot: Robot, geometry: Sequence[GeometryPrior]) -> dict[str, Array]:
        """Derivatives of the residuals by numbers of the geometry, (p, k, g), by kind.

        They are those of the robot without effects in the length by the drum, and cable forces are
        constant: relative errors of the order of the cables' strain.
        """
        pose, home, angle = self.pose, robot.home, self.dataset.measured.motor_angle
        length = sensitivities(robot.geometry, pose.position, pose.rotation)
        at_home = sensitivities(robot.geometry, home.position, home.rotation)
        winding = winding_of(robot.winches, angle)
        radius = np.array([winch.drum.winding_radius for winch in robot.winches])
        of_line, of_all = closure_by_geometry(length, at_home, winding, radius, np.ones_like(angle))
        swivel = swivel_sensitivities(robot.geometry, pose.position, pose.rotation)
        by_kind = {
            "closure": {**of_line, "layer_growth": of_all["layer_growth"][..., 0]},
            "swivel": by_geometry(swivel),
            "gauge": by_geometry(length),
        }
        out = {kind: np.zeros((*angle.shape, len(geometry))) for kind in by_kind}
        if self.dataset.hangs and geometry:
            out["statics"] = self._statics_by_geometry(robot, geometry)
        for index, item in enumerate(geometry):
            lines = [robot.names.index(item.line)] if item.line else slice(None)
            for kind, fields in by_kind.items():
                if (part := fields.get(item.field)) is not None:
                    own = part[..., "xyz".index(item.parameter)] if part.ndim == 3 else part
                    out[kind][:, lines, index] = own[:, lines]
        return out

    def _statics_by_geometry(self, robot: Robot, geometry: Sequence[GeometryPrior]) -> Array:
        """Derivatives of the statics by numbers of the geometry, (p, 6, g)."""
        found = self._statics(robot).by_robot
        out = np.zeros((len(self.dataset.measured), 6, len(geometry)))
        for index, item in enumerate(geometry):
            part = found.get(item.field)
            if part is None:
                continue
            lines = [robot.names.index(item.line)] if item.line else range(len(robot.names))
            point = part.shape[2] > len(robot.names)
            for line in lines:
                column = 3 * line + "xyz".index(item.parameter) if point else line
                out[..., index] += part[..., column]
        return out

    def _position(self, robot: Robot) -> Array:
        measured = self.dataset.measured.position
        if robot.tracker is None:
            return np.asarray(self.pose.position - measured)
        return tracked_position(robot.tracker, self._seen(robot.tracker), measured).residual

    def _rotation(self, robot: Robot) -> Array:
        if robot.tracker is None:
            return self._own_rotation
        angles = self.dataset.measured.angles
        return tracked_rotation(robot.tracker, self._seen(robot.tracker), angles).residual

    @cached_property
    def _own_rotation(self) -> Array:
        return rotation_residual(self.pose.rotation, self.dataset.measured.angles)

    def _swivel(self, robot: Robot) -> Array:
        shown = self.dataset.measured.swivel
        if not np.isfinite(shown).any():
            return shown
        return swivel_residual(robot.geometry, self.pose, shown)

    @cached_property
    def _force_basis(self) -> tuple[Array, Array]:
        structure = structure_matrix(self.basis.geometry, self.pose.position, self.pose.rotation)
        to_forces, to_cables = force_basis(structure)
        if self.dataset.moves:
            turn = continuous(to_cables)
            return np.swapaxes(turn, 1, 2) @ to_forces, to_cables @ turn
        return to_forces, to_cables

    @property
    def to_cables(self) -> Array:
        """From whitened forces to the least change of cable forces, (p, n, k)."""
        return self._force_basis[1]

    def _balance(self, robot: Robot, force: Array) -> Array:
        """Whitened forces that should carry the weight less those that do, (p, k), N."""
        structure = structure_matrix(robot.geometry, self.pose.position, self.pose.rotation)
        weight = gravity_wrench(robot.platform, self.pose.rotation)
        left = wrench_residual(structure, force, weight + self._inertial(robot))
        return np.asarray(-(self._force_basis[0] @ left[..., None])[..., 0])


def continuous(basis: Array) -> Array:
    """Rotations (p, k, k) of the columns of orthonormal bases that make them continuous in time.

    Each basis (p, m, k) is turned within its subspace to be nearest to that of the middle sample
    (orthogonal Procrustes problem), so that the rows of a trajectory have a spectrum.
    """
    left, _, right = np.linalg.svd(np.swapaxes(basis, 1, 2) @ basis[len(basis) // 2])
    return np.asarray(left @ right)


def start_pose(dataset: RobotDataset) -> Pose:
    """Measured positions and angles, completed by those of the home pose."""
    measured = dataset.measured
    home, free = home_of(dataset.robot), np.array(dataset.robot.platform.free)
    return completed(measured.position, measured.angles, home, free)


def _force_behind(line: Line, at: At, shown: Array) -> Array:
    """Cable force at which a cell shows ``shown``, N, by Newton's method; exact for a gain.

    One difference gives all derivatives: a cell at rest shows every force independently of the
    others, and friction that remembers others is a small part of the force.
    """
    force, size = shown.copy(), max(float(np.nanmax(np.abs(shown), initial=0.0)), 1.0)
    step = _FORCE_STEP * size
    for _ in range(_NEWTON_STEPS):
        here = line.readings(force, at)
        missing = shown - here
        if np.nanmax(np.abs(missing), initial=0.0) < _FORCE_TOLERANCE * size:
            break
        slope = (line.readings(force + step, at) - here) / step
        force = force + missing / np.maximum(slope, _LEAST_SLOPE)
    return force
