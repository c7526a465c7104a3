"""Constraint equations of a robot's poses as functions of the parameters of an identification.

A residual is model less measurement, in SI; the pose itself is always unknown. A calibration fits
the parameters of geometry, winches and instruments, and a law of elongation. A diagnosis fits
effects of the catalogue (``terms``) beside the geometry:

* the length by the drum of a line with effects is that of :class:`winchkit.model.line.Line`, which
  is the length under load; a law of elongation has the unstrained length, so that its residual is
  smaller by the factor 1 − ε;
* derivatives by geometry are those of the robot without effects in the length by the drum, and
  cable forces are constant: relative errors of the order of the cables' strain;
* derivatives by the coordinates of effects are forward differences, since an effect of the
  catalogue, perhaps a user's own, has no derivatives.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.model.line import Line
from winchkit.model.rotation import rotation_of
from winchkit.model.stages import At, Stage
from winchkit.robot.forces.balance import (
    force_basis,
    hanging_balance,
    hanging_residual,
    resting_balance,
    wrench_residual,
)
from winchkit.robot.forces.elongation import strain_of
from winchkit.robot.forces.force_distribution import approximate_forces
from winchkit.robot.geometry.constraints import (
    Constraint,
    Strain,
    Winding,
    cable_length,
    closure,
    closure_residual,
    mean_offset,
    position,
    rotation,
    swivel,
    swivel_residual,
    winding_of,
)
from winchkit.robot.geometry.kinematics import Pose, lengths
from winchkit.robot.geometry.pose_estimation import moved_pose, start_pose
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.geometry.tracker import (
    Tracker,
    pose_behind,
    reading_of,
    tracked_position,
    tracked_rotation,
)
from winchkit.robot.geometry.wrench import weight_by_payload
from winchkit.robot.identification.bundle_adjustment import BundleState, Rows, Weights, place
from winchkit.robot.identification.parametrized_robot import ParametrizedRobot
from winchkit.robot.identification.trajectory import SampledMotion

READING_OF = {
    "closure": "motor_angle",
    "position": "position",
    "rotation": "angles",
    "swivel": "swivel",
    "cable_length": "cable_length",
}
"""Measurement behind each kind of equation, in the order of the rows."""
KINDS = (*READING_OF, "balance")
"""``closure`` is the length by the drum, ``balance`` that of cable forces and weight."""
_RATIO_STEP = 1e-6
"""Relative step of a gear ratio for its derivative."""
_STEP = 1e-3
"""Step of a forward difference by an effect's coordinate; numerical."""
_NEWTON_STEPS, _FORCE_TOLERANCE = 8, 1e-9
"""Steps from a cell's reading to a force, and its relative tolerance; numerical."""
_FORCE_STEP, _LEAST_SLOPE, _LARGEST_STEP = 1e-4, 0.05, 1.0
"""Step of a derivative by the force, over the largest force, the smallest slope of a cell that is
divided by, and the largest step of the force over the largest one; numerical."""


@dataclass(frozen=True)
class RobotEquations(ParametrizedRobot):
    """Constraint equations of a robot at measured poses."""

    middle_force: float | None = None
    """Force, N, to which cable forces that were not measured are nearest; None without such."""
    trajectory: SampledMotion | None = None
    """Motion along the rows where they are samples in time."""
    balanced: bool | None = None
    """Whether the balance of cable forces takes part; None where a calibration decides it."""

    def start(self, values: Array) -> Pose:
        """Measured poses in the base frame, completed by the home pose, which is also the rotation
        of a pose that was not measured whole."""
        measured, home = self.measured, self.robot.home
        whole = np.all(np.isfinite(measured.angles), axis=1, keepdims=True)
        angles = np.where(whole, measured.angles, np.nan)
        tracker = self.robot_at(values).tracker
        if tracker is None:
            return start_pose(measured.position, angles, home, self.robot.geometry.free)
        # Without a measured rotation the platform is taken to stand as at home.
        turned = reading_of(tracker, Pose(np.zeros_like(measured.position), home.rotation)).rotation
        seen = np.where(whole[..., None], rotation_of(*np.nan_to_num(angles).T), turned)
        behind = pose_behind(tracker, Pose(measured.position, seen))
        known = np.isfinite(behind.position)
        there = np.where(known, behind.position, home.position)
        return self.robot.guided(Pose(there, behind.rotation))

    def of(self, poses: NDArray[np.bool_]) -> RobotEquations:
        """The equations of some of the poses, (p,)."""
        return replace(self, measured=self.measured[poses])

    @cached_property
    def winding(self) -> Winding:
        """Drum angles and winding laws at the measured motor angles, with nominal gear ratios."""
        return winding_of(self.robot.winches, self.measured.motor_angle)

    def winding_at(self, values: Array, share: float = 0.0) -> Winding:
        """The same with the gear ratios of the parameters, larger by ``share``."""
        if "gear_ratio" not in self.parameters.block:
            return self.winding
        ratios = values[self.parameters.block["gear_ratio"]] * (1 + share)
        winches = [
            replace(winch, gearbox=replace(winch.gearbox, ratio=float(ratio)))
            for winch, ratio in zip(self.robot.winches, ratios, strict=True)
        ]
        return winding_of(winches, self.measured.motor_angle)

    @cached_property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of equations that were measured, always in the same order."""
        there = {kind: getattr(self.measured, name) for kind, name in READING_OF.items()}
        kinds = [kind for kind, values in there.items() if np.any(np.isfinite(values))]
        return (*kinds, *(["balance"] if self.has_balance else []))

    @property
    def count(self) -> int:
        """Number of measured values of motors, positions, rotations, swivels and lengths."""
        every = (getattr(self.measured, name) for name in READING_OF.values())
        return sum(int(np.count_nonzero(np.isfinite(values))) for values in every)

    @property
    def hangs(self) -> bool:
        """Whether measured cable forces and a known weight determine the pose of the platform."""
        known = np.any(np.all(np.isfinite(self.measured.tension), axis=1))
        return self._weighed and bool(known)

    @property
    def rests(self) -> bool:
        """Whether its known weight, without measured forces and rotations, restricts the pose."""
        given = np.isfinite(self.measured.tension).any() or np.isfinite(self.measured.angles).any()
        return self._weighed and not given

    @property
    def _weighed(self) -> bool:
        return self.robot.hangs and self.robot.platform.mass > 0 and self.balanced is not False

    @property
    def has_balance(self) -> bool:
        """Whether the balance takes part: by default where the platform hangs, or the payload or
        the gains of cells are fitted."""
        if self.balanced is not None:
            return self.balanced
        block, std = self.parameters.block, self.parameters.std
        if self.hangs or self.rests or "cell_gain" in block:
            return True
        payload = np.concatenate([std[block["payload_mass"]], std[block["payload_centre"]]])
        return bool(np.any(payload > 0) and np.any(np.isfinite(self.measured.tension)))

    def by_drum(self, values: Array, robot: Robot, force: Array | None = None) -> Array:
        """Cable lengths by drums, home pose and home lengths, (p, n), m: unstrained ones, under
        load those of lines with effects; ``force`` as of :meth:`forces`."""
        radius = values[self.parameters.block["winding_radius"]]
        out = robot.home_length - self.winding_at(values).wound(radius, self.growth(values))
        if any(robot.modifiers):
            force = self.forces(values, robot) if force is None else force
            for i, line in enumerate(robot.lines):
                if line.modifiers:
                    out[:, i] = line.lengths(self._at(line, i, force[:, i]))
        return np.asarray(out)

    def forces(self, values: Array, robot: Robot) -> Array:
        """Cable forces behind the cells' readings, (p, n), N; zero without any reading."""
        shown = self.measured.tension
        if not np.any(np.isfinite(shown)):
            return np.zeros_like(shown)
        if "cell_gain" in self.parameters.block:
            shown = shown / (1 + values[self.parameters.block["cell_gain"]])
        out = shown.copy()
        runs = (slice(None),) if self.trajectory is None else self.trajectory.runs
        for i, stages in enumerate(robot.modifiers):
            if any(m.stage in (Stage.CELL, Stage.PULLEY) for m in stages):
                line = robot.lines[i]
                for rows in runs:
                    own = shown[rows, i]
                    out[rows, i] = _force_behind(line, self._at(line, i, own, rows), own)
        return out

    @cached_property
    def temperature(self) -> Array:
        """Of the cables, (p, n), degrees Celsius; 20 where it was not measured."""
        measured = self.measured.temperature
        return np.where(np.isfinite(measured), measured, 20.0)

    def _at(self, line: Line, index: int, force: Array, rows: slice = slice(None)) -> At:
        """Inputs of the modifiers of a line, at rest or in motion."""
        angle, trajectory = self.measured.motor_angle[rows, index], self.trajectory
        temperature = self.temperature[rows, index]
        if trajectory is None:
            return line.at_rest(angle, force, temperature)
        rate = trajectory.motor_rate[rows, index]
        return line.moments(trajectory.time[rows], angle, rate, force, temperature)

    def inertial(self, robot: Robot) -> Array | float:
        """Wrench of the platform's inertial forces, (p, 6), N and N m; zero at rest."""
        trajectory = self.trajectory
        return 0.0 if trajectory is None else trajectory.inertial_wrench(robot.platform)

    def strain(self, values: Array, robot: Robot, pose: Pose) -> Strain | None:
        """Strains of the cables at poses; None where no law of elongation is fitted. Derivatives by
        pose and geometry of forces that were not measured are left out: multiplied by a cable's
        compliance they are a thousandth of those of the lengths."""
        law, force = self.parameters.law, self.measured.tension
        if law is None:
            return None
        own = values[self.parameters.block["law"]]
        if self.middle_force is None:
            strain, by_law = strain_of(law, own, force)
            return Strain(strain, {"law": by_law})
        structure, known = robot.structure(pose), np.isfinite(force)
        middle = np.full(structure.shape[2], self.middle_force)
        computed = approximate_forces(structure, robot.weight(pose), middle)
        by_payload = -np.linalg.pinv(structure) @ weight_by_payload(robot.platform, pose.rotation)
        by_payload = np.where(known[..., None], 0.0, by_payload)
        force = np.where(known, force, computed)
        strain, by_law = strain_of(law, own, force)
        step = np.maximum(1e-3 * np.abs(force), 1e-3)
        slope = (strain_of(law, own, force + step)[0] - strain) / step
        return Strain(strain, {"law": by_law, "payload": slope[..., None] * by_payload})

    def constraints(
        self, state: BundleState, robot: Robot | None = None
    ) -> Iterator[tuple[str, Constraint]]:
        """All equations at a state, by kind, with derivatives by each line's own numbers."""
        robot = robot or self.robot_at(state.values)
        of_kind = {
            "closure": self._closure,
            "position": self._position,
            "rotation": self._rotation,
            "swivel": self._swivel,
            "cable_length": self._cable_length,
            "balance": self._balance,
        }
        for kind in self.kinds:
            found = of_kind[kind](state.values, robot, state.pose)
            # Guides hold the other coordinates, whatever a tracker shows of them.
            yield kind, replace(found, by_pose=found.by_pose * robot.geometry.free)

    def rows(self, state: BundleState) -> Iterator[Rows]:
        """All equations at a state with derivatives by the vector of parameters."""
        robot = self.robot_at(state.values)
        by_terms = self._by_terms(state, robot)
        for kind, constraint in self.constraints(state, robot):
            by_values = self._by_values(constraint, len(state.values))
            if by_terms:
                if by_values is None:
                    by_values = np.zeros((*constraint.residual.shape, len(state.values)))
                by_values[..., self.parameters.block["terms"]] = by_terms[kind]
            yield Rows(kind, constraint.residual, constraint.by_pose, by_values)

    def offsets(self, kind: str, state: BundleState) -> Array:
        """Mean reading of each line's instrument beyond its zero, (n,)."""
        residual = self.residuals(state, self.robot_at(state.values), [kind])[kind]
        return mean_offset(residual, angles=kind == "swivel")

    def residuals(
        self, state: BundleState, robot: Robot, kinds: Iterable[str], whiten: Array | None = None
    ) -> dict[str, Array]:
        """Residuals by kind without derivatives, (p, k) each, NaN where nothing was measured.
        ``whiten`` (p, k, 6) adds ``tension``, whitened forces that should carry the weight less
        those that do, N, in a basis that does not depend on the robot."""
        values, pose, measured = state.values, state.pose, self.measured
        length = lengths(robot.geometry, pose.position, pose.rotation)
        force = self.forces(values, robot)
        out: dict[str, Array] = {}
        for kind in kinds:
            if kind not in self.kinds:
                nothing = np.full((len(measured), 6), np.nan)
                out[kind] = getattr(measured, READING_OF[kind]) if kind in READING_OF else nothing
            elif kind == "closure":
                strain = self.strain(values, robot, pose)
                taken = 0.0 if strain is None else strain.value
                by_drum = self.by_drum(values, robot, force)
                out[kind] = closure_residual(length, by_drum, taken, robot.dead_length)
            elif kind == "swivel":
                zero = self._of_lines("swivel_zero", values)
                out[kind] = swivel_residual(robot.geometry, pose, measured.swivel, zero)
            elif kind == "cable_length":
                size = 1 + self._of_lines("length_scale", values)
                offset = self._of_lines("length_offset", values)
                out[kind] = length + (offset - measured.cable_length) / size
            elif kind == "balance" and self.hangs:
                inertial = self.inertial(robot)
                out[kind] = hanging_residual(robot.geometry, pose, force, robot.platform, inertial)
            else:
                made = {
                    "position": self._position,
                    "rotation": self._rotation,
                    "balance": self._balance,
                }
                out[kind] = made[kind](values, robot, pose).residual
        if whiten is not None:
            weight = robot.weight(pose) + self.inertial(robot)
            left = wrench_residual(robot.structure(pose), force, weight)
            out["tension"] = -(whiten @ left[..., None])[..., 0]
        return out

    def _closure(self, values: Array, robot: Robot, pose: Pose) -> Constraint:
        block = self.parameters.block
        radius, winding = values[block["winding_radius"]], self.winding_at(values)
        found = closure(
            robot.geometry,
            pose,
            robot.home,
            self.by_drum(values, robot),
            winding=winding,
            radius=radius,
            strain=self.strain(values, robot, pose),
            dead_length=robot.dead_length,
        )
        if "gear_ratio" not in block:
            return found
        growth = self.growth(values)
        change = self.winding_at(values, _RATIO_STEP).wound(radius, growth)
        change = change - winding.wound(radius, growth)
        by_ratio = change / (_RATIO_STEP * values[block["gear_ratio"]])
        return replace(found, by_line={**found.by_line, "gear_ratio": by_ratio})

    def _position(self, values: Array, robot: Robot, pose: Pose) -> Constraint:
        if robot.tracker is None:
            return position(pose, self.measured.position)
        seen = self._seen(robot.tracker, pose)
        return self._by_session(tracked_position(robot.tracker, seen, self.measured.position))

    def _rotation(self, values: Array, robot: Robot, pose: Pose) -> Constraint:
        if robot.tracker is None:
            return rotation(pose, self.measured.angles)
        seen = self._seen(robot.tracker, pose)
        return self._by_session(tracked_rotation(robot.tracker, seen, self.measured.angles))

    def _seen(self, tracker: Tracker, pose: Pose) -> Pose:
        """Poses that a tracker shows, which are those of its delay before."""
        if self.trajectory is None or not tracker.delay:
            return pose
        return moved_pose(pose, self.trajectory.earlier(tracker.delay))

    def _by_session(self, found: Constraint) -> Constraint:
        """The constraint with the derivatives by the frame in the columns of each session."""
        if self.instruments is None:
            return found
        part = found.by_robot["tracker_frame"]
        which = np.maximum(self.instruments.session_of(self.measured), 0)
        count = len(self.instruments.sessions)
        frame = np.zeros((*part.shape[:2], count, 6))
        for number in range(count):
            rows = which == number
            frame[rows, :, number] = part[rows]
        by = {**found.by_robot, "tracker_frame": frame.reshape(*part.shape[:2], 6 * count)}
        return replace(found, by_robot=by)

    def _swivel(self, values: Array, robot: Robot, pose: Pose) -> Constraint:
        zero = self._of_lines("swivel_zero", values)
        return swivel(robot.geometry, pose, self.measured.swivel, zero)

    def _cable_length(self, values: Array, robot: Robot, pose: Pose) -> Constraint:
        offset = self._of_lines("length_offset", values)
        if "length_scale" not in self.parameters.block:
            return cable_length(robot.geometry, pose, self.measured.cable_length, offset)
        size = 1 + self._of_lines("length_scale", values)
        # A reading (1 + s) L + o, compared as the length that it means.
        shown = self.measured.cable_length / size
        found = cable_length(robot.geometry, pose, shown, offset / size)
        by_line = {
            **found.by_line,
            "length_offset": np.ones_like(shown) / size,
            "length_scale": (self.measured.cable_length - offset) / size**2,
        }
        return replace(found, by_line=by_line)

    def _balance(self, values: Array, robot: Robot, pose: Pose) -> Constraint:
        force, inertial = self.forces(values, robot), self.inertial(robot)
        if self.rests:
            return resting_balance(robot.geometry, pose, robot.platform, inertial)
        if self.hangs:
            found = hanging_balance(robot.geometry, pose, force, robot.platform, inertial)
        else:
            structure = robot.structure(pose)
            whiten, _ = force_basis(structure)
            left = wrench_residual(structure, force, robot.weight(pose) + inertial)
            residual = (whiten @ left[..., None])[..., 0]
            by_payload = whiten @ weight_by_payload(robot.platform, pose.rotation)
            by = {"payload": by_payload, "tension": whiten @ structure}
            found = Constraint(residual, np.zeros((*residual.shape, 6)), {}, by)
        gain = 1 + self._of_lines("cell_gain", values)
        by_gain = found.by_robot["tension"] * np.nan_to_num(-force / gain)[:, None, :]
        return replace(found, by_robot={**found.by_robot, "cell_gain": by_gain})

    def _by_values(self, constraint: Constraint, count: int) -> Array | None:
        """Derivatives by the vector of parameters; those by other quantities are left out."""
        if not (constraint.by_line or constraint.by_robot):
            return None
        block = self._blocks
        out = np.zeros((*constraint.residual.shape, count))
        line = np.arange(out.shape[1])
        for name, part in constraint.by_line.items():
            if name in block:
                out[:, line[:, None] if part.ndim == 3 else line, block[name]] = part
        for name, part in constraint.by_robot.items():
            if name in block:
                out[..., block[name].ravel()] = part
        return out

    def _by_terms(self, state: BundleState, robot: Robot) -> dict[str, Array]:
        """Derivatives by the coordinates of effects, (p, k, m), by kind; empty without effects."""
        if not self.terms:
            return {}
        kinds, whiten = self.kinds, None
        if "balance" in kinds and not self.hangs:
            # The basis of whitened forces is not continuous in the robot.
            kinds = tuple(kind for kind in kinds if kind != "balance")
            whiten, _ = force_basis(robot.structure(state.pose))
        here = self.residuals(state, robot, kinds, whiten)
        _, high = self.parameters.bounds
        columns: dict[str, list[Array]] = {kind: [] for kind in here}
        for index in self.parameters.block["terms"]:
            step = _STEP * max(1.0, abs(state.values[index]))
            moved = state.values.copy()
            moved[index] += step if moved[index] + step <= high[index] else -step
            there = self.residuals(
                BundleState(moved, state.pose), self.robot_at(moved), kinds, whiten
            )
            for kind, column in columns.items():
                by = (there[kind] - here[kind]) / (moved[index] - state.values[index])
                column.append(by)
        out = {kind: np.stack(column, axis=-1) for kind, column in columns.items()}
        return out if whiten is None else out | {"balance": -out["tension"]}

    @cached_property
    def _blocks(self) -> dict[str, Array]:
        """Blocks of parameters, with those of the payload in one."""
        block = self.parameters.block
        payload = np.concatenate([block["payload_mass"], block["payload_centre"]])
        return {**block, "payload": payload}


def _force_behind(line: Line, at: At, shown: Array) -> Array:
    """Cable force at which a cell shows ``shown``, N, by Newton's method with one difference for
    all: friction that remembers other samples is a small part of the force."""
    force, size = shown.copy(), max(float(np.nanmax(np.abs(shown), initial=0.0)), 1.0)
    step = _FORCE_STEP * size
    for _ in range(_NEWTON_STEPS):
        here = line.readings(force, at)
        missing = shown - here
        if np.nanmax(np.abs(missing), initial=0.0) < _FORCE_TOLERANCE * size:
            break
        slope = (line.readings(force + step, at) - here) / step
        change = missing / np.maximum(slope, _LEAST_SLOPE)
        # A characteristic with an extremum has no force beyond it: unlimited steps overflow there.
        force = force + np.clip(change, -_LARGEST_STEP * size, _LARGEST_STEP * size)
    return force


def placed(equations: RobotEquations, sigma: Mapping[str, float]) -> BundleState:
    """Nominal parameters within bounds, and the poses estimated with them, without the instruments
    whose zeros are not known."""
    values = np.clip(equations.parameters.nominal, *equations.parameters.bounds)
    weights = Weights({**sigma, "swivel": np.inf, "cable_length": np.inf})
    return place(equations, BundleState(values, equations.start(values)), weights)


def started(
    equations: RobotEquations, sigma: Mapping[str, float]
) -> tuple[RobotEquations, BundleState]:
    """The state of :func:`placed`, with the zeros of instruments at their mean readings."""
    state, parameters = placed(equations, sigma), equations.parameters
    for kind, block in (("swivel", "swivel_zero"), ("cable_length", "length_offset")):
        if block in parameters.block:
            parameters = parameters.starting(block, equations.offsets(kind, state))
    values = np.clip(parameters.nominal, *parameters.bounds)
    return replace(equations, parameters=parameters), BundleState(values, state.pose)
