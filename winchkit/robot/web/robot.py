"""State of the Robot view: a robot's profile, its poses, and the last calibration.

It calls :func:`winchkit.calibrate`, the force distribution and the feasibility of the public model;
positions are in m, forces in N, in the base frame.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.catalog import find
from winchkit.errors import UsageError
from winchkit.model.rotation import rotation_of
from winchkit.plain_json import finite_or_none, significant
from winchkit.profile_edit.naming import extended_name
from winchkit.robot.calibration.calibrate import Calibrated, calibrate, split
from winchkit.robot.calibration.pose_design import next_poses
from winchkit.robot.calibration.prediction import cable_errors, rms
from winchkit.robot.calibration.profile import Provenance, write_calibrated
from winchkit.robot.files.poses import MeasuredPoses, read_poses
from winchkit.robot.forces.force_distribution import ForceLimits, quadratic, wrench_feasibility
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.robot import Robot, robot_of
from winchkit.robot.report.calibration import calibration_html, headline, largest_changes
from winchkit.runs.read import read_run
from winchkit.schema.profiles.robot import RobotProfile
from winchkit.schema.read import read_robot
from winchkit.units import GRAVITY

_GRID = 22
"""Cells of the slice along its longer side: 484 linear programmes of 3 ms."""
_ARROWS = 120
"""Poses whose error is drawn as an arrow."""
_LOWEST, _HIGHEST = 0.7, 5.0
"""Default limits of the cable forces in weights of the platform (the picture only)."""
_NO_MASS = (20.0, 150.0)
"""The same where the profile has no mass, N."""


@dataclass(frozen=True)
class _State:
    source: str = ""
    profile: RobotProfile | None = None
    files: tuple[Path, ...] = ()
    measured: MeasuredPoses | None = None
    found: Calibrated | None = None
    proposed: tuple[dict[str, Any], ...] = ()
    number: int = 0
    """Counts changes, so that a page knows when to ask again."""


class RobotWork:
    """State of the Robot view."""

    def __init__(self, folder: Path, named: Callable[[str | Path], str] = str) -> None:
        self.folder = folder
        self.named = named
        self._state = _State()

    @property
    def is_open(self) -> bool:
        """Whether a robot's profile is open."""
        return self._state.profile is not None

    # Work, in the thread of the workspace.

    def open(self, paths: Sequence[str | Path], profile: str | None = None) -> None:
        """Read a robot's profile and its poses, and calibrate; raises FileError, RunError."""
        if profile is not None:
            self._set(source=profile, profile=read_robot(find("profiles", profile)))
            self._set(measured=None, found=None, files=(), proposed=())
        declared = self._declared()
        if paths:
            files = (*self._state.files, *(Path(path) for path in paths))
            measured = read_poses([read_run(path) for path in files], declared)
            self._set(files=files, measured=measured, found=None, proposed=())
            self.calibrate()

    def calibrate(self) -> None:
        """Fit nine of ten poses, and compare with the others; raises UsageError."""
        measured = self._measured()
        self._set(found=calibrate(robot_of(self._declared()), measured), proposed=())

    def propose(self) -> None:
        """Propose the poses that add most information."""
        chosen = next_poses(self._found(), 5)
        proposed = [
            {"position": list(p.position), "angles": list(p.angles), "gain": p.gain} for p in chosen
        ]
        self._set(proposed=tuple(proposed))

    # What routes read.

    def summary(self) -> dict[str, Any] | None:
        """Data for every page at every change; None without a robot."""
        state = self._state
        if state.profile is None:
            return None
        return {"name": Path(state.source).stem, "number": state.number}

    def view(self) -> dict[str, Any]:
        """Geometry, poses and the calibration, as the page shows them."""
        state, declared = self._state, self._declared()
        robot = self._robot()
        poses = 0 if state.measured is None else len(state.measured)
        held = 0 if state.measured is None else len(split(state.measured)[1])
        return {
            "name": Path(state.source).stem,
            "lines": list(robot.names),
            "mass": robot.platform.mass,
            "files": [path.name for path in state.files],
            "poses": poses,
            "held_out": held,
            "exit_points": _rounded(robot.geometry.exit_point),
            "limits": list(self._limits(robot)),
            "calibration": None if state.found is None else _calibration(state.found),
            "proposed": list(state.proposed),
            "command": "winchkit calibrate "
            + shlex.join([self.named(state.source), *map(self.named, state.files)])
            + f" -o {shlex.quote(extended_name(declared.name, 'calibrated'))}",
        }

    def picture(self, row: int, limits: tuple[float, float] | None = None) -> dict[str, Any]:
        """Cables and platform at a pose."""
        robot, pose, tension = self._at(row)
        low, high = limits or self._limits(robot)
        structure = robot.structure(pose)[0]
        if tension is not None and np.all(np.isfinite(tension)):
            source = "measured"
        else:
            forces = quadratic(structure, robot.weight(pose)[0], ForceLimits(low, high))
            tension, source = forces.value, "computed" if forces.feasible else "none"
        return {"row": row, **pose_picture(robot, pose, tension, source)}

    def slice(self, height: float, row: int, limits: tuple[float, float]) -> dict[str, Any]:
        """Wrench feasibility at a height, m, with the rotation of a pose: the least distance of the
        forces from their limits by cell, N, None where no forces balance the weight."""
        robot, pose, _ = self._at(row)
        exits = robot.geometry.exit_point
        low, high = exits.min(axis=0), exits.max(axis=0)
        step = float(np.max(high[:2] - low[:2])) / _GRID
        x, y = (np.arange(low[i] + step / 2, high[i], step) for i in (0, 1))
        force = ForceLimits(*limits)
        margin: list[list[float | None]] = []
        for along in y:
            cells: list[float | None] = []
            for across in x:
                there = Pose(np.array([[across, along, height]]), pose.rotation)
                found = wrench_feasibility(robot.structure(there)[0], robot.weight(there)[0], force)
                cells.append(round(found.margin, 2) if found.feasible else None)
            margin.append(cells)
        return {"height": height, "x": _rounded(x), "y": _rounded(y), "margin": margin}

    def profile_text(self) -> tuple[str, str]:
        """File name and text of the calibrated profile; raises UsageError where there is none."""
        found = self._found()
        out = self.folder / extended_name(self._state.source, "calibrated")
        names = [path.name for path in self._state.files]
        source = find("profiles", self._state.source)
        where = Provenance(names, datetime.now(UTC).date())
        write_calibrated(source, found, out, where, replace=True)
        return out.name, out.read_text(encoding="utf-8")

    def report(self) -> str:
        """The report of the calibration as one page."""
        return calibration_html(self._found(), [], self._state.source, self._state.source)

    def _set(self, **changes: Any) -> None:
        self._state = replace(self._state, **changes, number=self._state.number + 1)

    def _declared(self) -> RobotProfile:
        if self._state.profile is None:
            raise UsageError("no robot's profile is open; choose one first")
        return self._state.profile

    def _measured(self) -> MeasuredPoses:
        if self._state.measured is None:
            raise UsageError("no poses are open; drop a recording of the robot's poses")
        return self._state.measured

    def _found(self) -> Calibrated:
        if self._state.found is None:
            raise UsageError("nothing is calibrated yet; drop a recording of the robot's poses")
        return self._state.found

    def _robot(self) -> Robot:
        """The calibrated robot where there is one."""
        found = self._state.found
        robot = robot_of(self._declared())
        if found is None or found.refusal:
            return robot
        return replace(
            robot,
            geometry=found.equations.geometry(found.values),
            platform=found.equations.platform(found.values),
        )

    def _limits(self, robot: Robot) -> tuple[float, float]:
        weight = GRAVITY * robot.platform.mass
        if weight <= 0:
            return _NO_MASS
        low, high = (float(f"{factor * weight:.1g}") for factor in (_LOWEST, _HIGHEST))
        return low, high

    def _at(self, row: int) -> tuple[Robot, Pose, Array | None]:
        robot, measured = self._robot(), self._state.measured
        count = 0 if measured is None else len(measured)
        if not 0 <= row <= count:
            raise UsageError(f"pose {row}: there are 0 (home) to {count}")
        if row == 0 or measured is None:
            return robot, robot.home, None
        position, angles = measured.position[row - 1], measured.angles[row - 1]
        if np.all(np.isfinite(position)):
            turned = rotation_of(*np.nan_to_num(angles)[:, None])
            return robot, Pose(position[None, :], turned), measured.tension[row - 1]
        there = robot.poses_at(measured.motor_angle[row - 1 : row]).pose
        if not np.all(np.isfinite(there.position)):
            raise UsageError(f"pose {row}: it was not measured, and its motor angles lead to none")
        return robot, there, measured.tension[row - 1]


def pose_picture(robot: Robot, pose: Pose, tension: Array, source: str) -> dict[str, Any]:
    """Platform and cables at a pose; tensions are ``measured``, ``computed`` or ``none``, by
    ``source``."""
    anchors = robot.geometry.anchor_point
    position, rotation = pose.position[0], pose.rotation[0]
    return {
        "position": _rounded(position),
        "anchors": _rounded(position + anchors @ rotation.T),
        "corners": _rounded(position + _corners(anchors) @ rotation.T),
        "tension": _rounded(tension),
        "source": source,
    }


def _calibration(found: Calibrated) -> dict[str, Any]:
    before, after = found.validation_before, found.validation_after
    equations, values = found.equations, found.values
    cables = [
        [rms(error) for error in cable_errors(equations, own, found.weights).T]
        for own in (equations.parameters.nominal, values)
    ]
    sigma = found.weights.sigma.get("position")
    drawn = np.flatnonzero(np.isfinite(before.distance) & np.isfinite(after.distance))[:_ARROWS]
    return {
        "headline": headline(found),
        "refused": found.refusal,
        "before": finite_or_none(rms(before.distance)),
        "after": finite_or_none(rms(after.distance)),
        "largest": finite_or_none(float(np.nanmax(after.distance, initial=0.0))),
        "instrument": None if sigma is None else float(sigma),
        "parameters": found.observed.free,
        "fitted": len(equations.measured),
        "arrows": {
            "at": _rounded(after.measured[drawn]),
            "before": _rounded(before.vector[drawn], 4),
            "after": _rounded(after.vector[drawn], 4),
        },
        "cables": {"before": _rounded(cables[0], 4), "after": _rounded(cables[1], 4)},
        "changes": largest_changes(found),
        "warnings": list(found.warnings),
        "unobservable": list(found.observed.unobservable),
    }


def _corners(anchors: Array) -> Array:
    """Corners of the smallest box around the anchor points, (8, 3)."""
    ends = np.stack([anchors.min(axis=0), anchors.max(axis=0)])
    return np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i, j, k in np.ndindex(2, 2, 2)])


def _rounded(values: Any, digits: int = 6) -> Any:
    """Numbers of an array as nested lists, None where one is not finite."""
    array = np.asarray(values, dtype=float)
    if array.ndim > 1:
        return [_rounded(row, digits) for row in array]
    return significant(array.tolist(), digits)
