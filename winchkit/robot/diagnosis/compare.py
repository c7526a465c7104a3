"""Comparison of a robot's profile with poses: errors and their attribution, without a fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.compare import Compared
from winchkit.diagnosis.data.input_denoising import contrasts
from winchkit.diagnosis.residuals.attribution import Attribution
from winchkit.diagnosis.residuals.traces import pose_traces
from winchkit.diagnosis.results import Comparison, OutputError
from winchkit.effects.catalogue import Catalogue
from winchkit.robot.diagnosis.adjustment import point_of_file
from winchkit.robot.diagnosis.attribution import pose_attributions
from winchkit.robot.diagnosis.dataset import RobotDataset, prepare_poses
from winchkit.robot.diagnosis.errors import UNITS, Errors, column_names, errors_of, rms, signal_rms
from winchkit.robot.diagnosis.regression import PoseRegression
from winchkit.robot.diagnosis.trajectory_regression import regression_at
from winchkit.robot.effects.bind import robot_terms
from winchkit.robot.identification.variance_components import START
from winchkit.runs.run import Run
from winchkit.schema.profiles.robot import RobotProfile

_WITHOUT_POSITION = (
    "platform_position is not compared: these cables alone do not determine the pose of the "
    "platform; its measured positions take part in the error of the cable lengths"
)


@dataclass(frozen=True)
class RobotCompared(Compared):
    """A comparison of poses."""

    wing: ClassVar[str] = "robot"

    regression: PoseRegression
    errors: Errors
    followed: Mapping[str, Attribution]
    """By output the variable with the largest share of its error."""


def compared(
    runs: Sequence[Run], profile: RobotProfile, catalogue: Catalogue | None = None
) -> RobotCompared:
    """Compare poses with a robot's profile at its file values."""
    dataset = prepare_poses(runs, profile)
    terms = robot_terms(profile, catalogue, moving=dataset.moves)
    regression = regression_at(point_of_file(dataset, terms, START))
    errors = errors_of(regression, regression.residuals(terms))
    noise = _noise(errors, dataset)
    follows = pose_attributions(regression, errors)
    size = signal_rms(regression)
    outputs = {
        name: OutputError(
            unit=UNITS[name],
            samples=int(np.count_nonzero(np.isfinite(error))),
            band=None,
            signal_rms=size[name],
            rms=rms(name, error),
            max=_largest(name, error),
            bias=float(np.nanmean(error)),
            noise_rms=noise.get(name),
            follows=tuple((f.variable, f.share) for f in follows if f.output == name),
        )
        for name, error in errors.items()
    }
    most: dict[str, Attribution] = {}
    for followed in follows:
        most.setdefault(followed.output, followed)
    traces = pose_traces(column_names(dataset, errors), UNITS, errors)
    notes = dataset.notes
    if "platform_position" not in errors and np.isfinite(dataset.measured.position).any():
        notes = (*notes, _WITHOUT_POSITION)
    comparison = Comparison(outputs, None, notes, traces=traces)
    return RobotCompared(regression, comparison, errors, most)


def _largest(name: str, error: Array) -> float:
    if name == "platform_position":
        return float(np.sqrt(np.nanmax(np.sum(error**2, axis=1))))
    return float(np.nanmax(np.abs(error)))


def _noise(errors: Errors, dataset: RobotDataset) -> dict[str, float]:
    """Rms of the contrasts of repeated poses (pure error); empty without repeats."""
    groups = [np.flatnonzero(dataset.pose == n) for n in range(int(dataset.pose.max()) + 1)]
    many = [group for group in groups if len(group) > 1]
    if not many:
        return {}
    differences = {
        name: np.concatenate([contrasts(error[group])[1] for group in many])
        for name, error in errors.items()
    }
    return {name: rms(name, values) for name, values in differences.items()}
