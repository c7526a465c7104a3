"""Data set of a robot: poses at rest and which rows repeat one, or samples of a trajectory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from winchkit.arguments import require_type, require_types
from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.data.repeats import Repeats
from winchkit.errors import Fault, RunError
from winchkit.robot.files.poses import MeasuredPoses, read_poses, read_trajectory
from winchkit.robot.identification.trajectory import SampledMotion, trajectory_of
from winchkit.runs.run import Run
from winchkit.schema.profiles.robot import RobotProfile
from winchkit.schema.profiles.winch import WinchProfile

LEAST_POSES = 10
"""Least number of poses, of a data set and of a run that is a fold of its own (rule of thumb)."""
_ANGLE_TOLERANCE = 0.02
"""Rms difference of motor angles within which rows repeat a pose, in their standard deviation."""
_TENSION_TOLERANCE = 0.03
"""Relative difference of the mean tension within which rows repeat a pose (rule of thumb)."""
_LEAST_KNOWN_SHARE = 0.5
"""Share of finite tensions above which tensions are used."""


@dataclass(frozen=True, kw_only=True)
class RobotDataset(Dataset):
    """Poses of one robot: a row is a pose at rest, without order in time, or a sample in motion."""

    wing: ClassVar[str] = "robot"

    robot: RobotProfile
    measured: MeasuredPoses
    pose: NDArray[np.intp]
    """Number of the distinct pose of each row, (p,)."""
    runs: tuple[str, ...]
    """Files."""
    trajectory: SampledMotion | None = None
    """Motion along the rows where they are samples in time; None for poses at rest."""
    balanced: bool = True
    """Whether the measured tensions balance the platform's weight well enough to be used."""

    @property
    def profile_name(self) -> str:
        """Name within the robot's file."""
        return self.robot.name

    @property
    def run_names(self) -> tuple[str, ...]:
        """Files of the runs."""
        return self.runs

    @property
    def run_files(self) -> tuple[str, ...]:
        """Files of the runs."""
        return self.runs

    @property
    def outputs(self) -> tuple[str, ...]:
        """Outputs: cable lengths, and tensions where they are compared with the weight. The statics
        of a hanging platform determine its pose and are among the rows of the lengths."""
        return self.shown_outputs if not self.hangs else ("cable_length",)

    @property
    def shown_outputs(self) -> tuple[str, ...]:
        """Outputs on which an effect may act."""
        return ("cable_length", "tension") if self.has_balance else ("cable_length",)

    @property
    def moves(self) -> bool:
        """Whether rows are samples of a trajectory."""
        return self.trajectory is not None

    @property
    def hangs(self) -> bool:
        """Whether cable forces and the weight determine where the platform stands."""
        return not self.restrained and self.robot.platform.mass > 0 and self.has_balance

    @property
    def restrained(self) -> bool:
        """Whether the robot has as many cables as its platform degrees of freedom, or more."""
        return len(self.names) >= len(self.robot.platform.degrees_of_freedom)

    @property
    def has_balance(self) -> bool:
        """Whether tensions are compared with the weight."""
        return self.balanced and self.has_tension

    @property
    def has_tension(self) -> bool:
        """Whether most tensions were measured."""
        return bool(np.mean(np.isfinite(self.measured.tension)) > _LEAST_KNOWN_SHARE)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the lines."""
        return tuple(line.name for line in self.robot.line)


def prepare_poses(runs: Sequence[Run], robot: RobotProfile) -> RobotDataset:
    """Read the poses of a robot's runs, or the samples of its logs in motion. Raises RunError with
    every fault; for fewer than ten poses, or no redundancy beyond the coordinates of each pose."""
    require_types(runs, Run, "runs")
    require_type(robot, RobotProfile, "profile")
    if not runs:
        raise RunError("no run given")
    samples = read_trajectory(runs, robot)
    if samples is None:
        measured, trajectory = read_poses(runs, robot), None
    else:
        measured, trajectory = trajectory_of(samples, robot)
        measured = replace(
            measured, notes=(*measured.notes, _motion_note(measured, trajectory, robot))
        )
    place = ", ".join(run.path or run.name for run in runs)
    if len(measured) < LEAST_POSES:
        raise RunError(
            Fault(f"only {len(measured)} poses; at least {LEAST_POSES} are needed to judge", place)
        )
    kinds = (measured.motor_angle, measured.position, measured.angles)
    degrees = len(robot.platform.degrees_of_freedom)
    spare = sum(int(np.isfinite(values).sum()) for values in kinds) - degrees * len(measured)
    if len(robot.line) < degrees and robot.platform.mass > 0:
        spare += degrees * int(np.isfinite(measured.tension).all(axis=1).sum())
    for values in (measured.swivel, measured.cable_length):
        # Each line's instrument has a zero of its own.
        spare += max(0, int(np.isfinite(values).sum()) - values.shape[1])
    if spare <= 0:
        raise RunError(
            Fault(
                "no measurement beyond those that determine the poses themselves; measure the "
                "platform (platform_x, platform_y, platform_z), swivel angles, or, of a hanging "
                "platform of known mass, the tensions",
                place,
            )
        )
    winch = robot.line[0].winch
    assert isinstance(winch, WinchProfile)
    return RobotDataset(
        profile=winch,
        recordings=(),
        repeats=(Repeats((0,), (np.arange(len(measured)),)),),
        notes=measured.notes,
        robot=robot,
        measured=measured,
        pose=_distinct(measured) if trajectory is None else np.arange(len(measured)),
        trajectory=trajectory,
        runs=tuple(run.path or run.name for run in runs),
    )


def _motion_note(measured: MeasuredPoses, trajectory: SampledMotion, robot: RobotProfile) -> str:
    """How the rows of a trajectory are used, and the forces that its motion needs."""
    inertial = trajectory.inertial_wrench(robot.platform)[:, :3]
    force = float(np.sqrt(np.mean(np.sum(inertial**2, axis=1))))
    return (
        f"a trajectory of {len(measured)} samples; inertial force {force:.2g} N rms, its standard "
        f"deviation {trajectory.force_std(robot.platform):.2g} N"
    )


def _distinct(measured: MeasuredPoses) -> NDArray[np.intp]:
    """Number of each row's distinct pose, (p,)."""
    angle = measured.motor_angle
    spread = np.maximum(np.nanstd(angle, axis=0), 1e-9)
    scaled = np.where(np.isfinite(angle), angle / spread, np.inf)
    pull = _mean_pull(measured.tension)
    first: list[int] = []
    out = np.empty(len(angle), dtype=np.intp)
    for row in range(len(angle)):
        same = [n for n, other in enumerate(first) if _is_repeat(row, other, scaled, pull)]
        out[row] = same[0] if same else len(first)
        if not same:
            first.append(row)
    return out


def _mean_pull(tension: Array) -> Array:
    known = np.isfinite(tension)
    count = np.maximum(known.sum(axis=1), 1)
    return np.asarray(np.where(known, tension, 0.0).sum(axis=1) / count)


def _is_repeat(row: int, other: int, scaled: Array, pull: Array) -> bool:
    with np.errstate(invalid="ignore"):
        difference = scaled[row] - scaled[other]
    if not np.sqrt(np.mean(difference**2)) < _ANGLE_TOLERANCE:
        return False
    return bool(abs(pull[row] - pull[other]) <= _TENSION_TOLERANCE * max(abs(pull[row]), 1e-9))
