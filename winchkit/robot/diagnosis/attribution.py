"""Attribution of a robot's errors to lines, position, rotation, lengths, tensions, temperature.

The share is the correlation ratio η²: variance of the means over eight bins of a variable, over the
error's power, less its expectation by chance. It is taken line by line (axis by axis of a
position), since an effect on one line shows there alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.residuals.attribution import LEAST_SHARE, Attribution, quantile_edges
from winchkit.model.rotation import angles_of
from winchkit.robot.diagnosis.errors import Errors
from winchkit.robot.diagnosis.regression import PoseRegression

AXES = ("x", "y", "z")
"""Columns of a position's error."""
ON_PLATFORM = tuple(f"platform_{name}" for name in (*AXES, "roll", "pitch", "yaw"))
"""Variables of the pose itself."""
_BINS = 8
"""Bins over a variable; rule of thumb."""
_LEAST_DEVIATIONS = 3.0
"""Standard deviations by chance that a share must exceed."""
_LINE_SHARE = 0.5
"""Share of one line above which the line is named."""
_LEAST_POSES = 20
"""Least number of samples of a line (rule of thumb)."""


@dataclass(frozen=True)
class _Share:
    """Share of an error's power explained by the means over a variable's bins."""

    share: float
    """η² less its expectation by chance."""
    chance_share: float
    """Three standard deviations of the share by chance."""
    column: int
    """Line or axis with the largest part of it."""
    own_share: bool
    """Whether that line has more than half of it."""


def pose_attributions(regression: PoseRegression, errors: Errors) -> list[Attribution]:
    """Variables that explain the errors of each output, the largest share first."""
    variables, out = variables_of_poses(regression), []
    for output, error in on_cables(regression, errors).items():
        lines = AXES if output == "platform_position" else regression.dataset.names
        found = []
        for name, values in variables.items():
            if values.shape[1] not in (1, error.shape[1]):
                continue
            taken = _taken(np.broadcast_to(values, error.shape), error)
            if taken.share > max(LEAST_SHARE, taken.chance_share):
                line = lines[taken.column] if taken.own_share else None
                found.append(Attribution(output, name, taken.share, line=line))
        if output != "platform_position":
            found += _constants(regression, output, error)
        out += sorted(found, key=lambda f: -f.share)
    return out


def most_significant(values: Array, error: Array) -> int:
    """Column (line or axis) whose error a variable explains most."""
    return _taken(np.broadcast_to(values, error.shape), error).column


def on_cables(regression: PoseRegression, errors: Errors) -> Errors:
    """Errors as they are drawn: those of tensions as the least cable forces that balance them."""
    out = dict(errors)
    if "tension" in out:
        known = np.isfinite(out["tension"])
        inside = np.where(known, out["tension"], 0.0)
        spread = (regression.to_cables @ inside[..., None])[..., 0]
        out["tension"] = np.where(known.all(axis=1, keepdims=True), spread, np.nan)
    return out


def variables_of_poses(regression: PoseRegression) -> dict[str, Array]:
    """Variables by name, (p, 1) of the platform, (p, n) of the lines, SI."""
    dataset, measured = regression.dataset, regression.dataset.measured
    angle = measured.motor_angle
    drum = np.empty_like(angle)
    for i, winch in enumerate(regression.robot.winches):
        turned = angle[:, i] - winch.reference.motor_angle
        drum[:, i] = turned * winch.gearbox.direction / winch.gearbox.ratio
    pose = regression.point.pose
    place = np.concatenate([pose.position, angles_of(pose.rotation)], axis=1)
    out = {name: place[:, [k]] for k, name in enumerate(ON_PLATFORM)}
    out |= {
        "cable_length": regression.robot.lengths_at(angle),
        "motor_angle": angle,
        "drum_angle": drum,
    }
    if dataset.trajectory is not None:
        out["time"] = dataset.trajectory.time[:, None]
        out["motor_velocity"] = dataset.trajectory.motor_rate
    if dataset.has_tension:
        out["tension"] = measured.tension
    if np.isfinite(measured.temperature).any():
        out["temperature"] = measured.temperature
    return out


def _taken(values: Array, error: Array) -> _Share:
    """η² over quantile bins, column by column, without the columns' means."""
    known = np.isfinite(error) & np.isfinite(values)
    total, count, between, bins = 0.0, 0, np.zeros(error.shape[1]), 0
    for k in range(error.shape[1]):
        there = known[:, k]
        x, e = values[there, k], error[there, k]
        total, count = total + float(e @ e), count + len(e)
        if len(e) < _LEAST_POSES or np.ptp(x) <= 1e-9 * max(1.0, float(np.abs(x).max())):
            continue
        edges = quantile_edges(x, _BINS)
        number = np.searchsorted(edges, x, side="right")
        many = np.bincount(number)
        used = many > 0
        sums = np.bincount(number, weights=e - e.mean())
        between[k] = float(np.sum(sums[used] ** 2 / many[used]))
        bins += int(np.count_nonzero(used)) - 1
    if not total or not bins:
        return _Share(0.0, 1.0, 0, own_share=False)
    most = int(np.argmax(between))
    share = float(between.sum()) / total - bins / count
    own_share = bool(between[most] > _LINE_SHARE * between.sum())
    return _Share(
        max(0.0, share), _LEAST_DEVIATIONS * float(np.sqrt(2 * bins)) / count, most, own_share
    )


def _constants(regression: PoseRegression, output: str, error: Array) -> list[Attribution]:
    """Shares of a constant per line and of a constant per pose."""
    known, out = np.isfinite(error), []
    winch = np.broadcast_to(np.arange(error.shape[1]), error.shape)
    pose = np.broadcast_to(regression.dataset.pose[:, None], error.shape)
    kinds = {"winch": winch} if regression.dataset.moves else {"winch": winch, "pose": pose}
    for name, values in kinds.items():
        taken = _category_share(values[known], error[known])
        if taken.share > max(LEAST_SHARE, taken.chance_share):
            own = name == "winch" and taken.own_share
            line = regression.dataset.names[taken.column] if own else None
            out.append(Attribution(output, name, taken.share, line=line))
    return out


def _category_share(category: NDArray[np.intp], error: Array) -> _Share:
    """η² over categories less its expectation by chance."""
    total = float(error @ error)
    if total == 0.0:
        return _Share(0.0, 1.0, 0, own_share=False)
    count = np.bincount(category)
    used = count > 0
    means = np.zeros(len(count))
    means[used] = np.bincount(category, weights=error)[used] ** 2 / count[used]
    many = int(np.count_nonzero(used))
    share = float(means.sum()) / total - many / len(error)
    chance = _LEAST_DEVIATIONS * float(np.sqrt(2 * many)) / len(error)
    most = int(np.argmax(means))
    own_share = bool(means[most] > _LINE_SHARE * means.sum())
    return _Share(max(0.0, share), chance, most, own_share)
