"""What a robot's errors follow: lines, poses, lengths, tensions, angles, temperature."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from winchkit.diagnosis.follows import Followed, binned_share
from winchkit.diagnosis.robot.figures import Errors
from winchkit.diagnosis.robot.problem import RobotProblem

__all__ = ["follows_of"]

Array = NDArray[np.float64]
_WORTH = 0.02


def follows_of(problem: RobotProblem, errors: Errors) -> list[Followed]:
    """Per output the variables that its error follows, largest share first.

    ``winch`` is the share of the lines' own constants, ``pose`` that of what the lines of one pose
    have in common.
    """
    out: list[Followed] = []
    for output in ("cable_length",):
        error = errors[output]
        known = np.isfinite(error)
        found = []
        for name, values in _variables(problem).items():
            there = known & np.isfinite(values)
            if not there.any():
                continue
            share = (
                _category_share(values[there].astype(np.intp), error[there])
                if name in ("winch", "pose")
                else binned_share(values[there], error[there], int(np.count_nonzero(there)))
            )
            if share > _WORTH:
                found.append(Followed(output, name, share))
        out += sorted(found, key=lambda f: -f.share)
    return out


def _variables(problem: RobotProblem) -> dict[str, Array]:
    """By name, (p, n)."""
    dataset, measured = problem.dataset, problem.dataset.measured
    angle = measured.motor_angle
    drum = np.empty_like(angle)
    for i, winch in enumerate(problem.robot.winches):
        turned = angle[:, i] - winch.reference.motor_angle
        drum[:, i] = turned * winch.gearbox.direction / winch.gearbox.ratio
    out = {
        "winch": np.broadcast_to(np.arange(angle.shape[1], dtype=float), angle.shape),
        "pose": np.broadcast_to(dataset.pose[:, None].astype(float), angle.shape),
        "cable_length": problem.robot.lengths_at(angle),
        "motor_angle": angle,
        "drum_angle": drum,
    }
    if dataset.has_tension:
        out["tension"] = measured.tension
    if np.isfinite(measured.temperature).any():
        out["temperature"] = measured.temperature
    return out


def _category_share(category: NDArray[np.intp], error: Array) -> float:
    """Share of the error's power in the means of its categories, less what chance gives."""
    total = float(error @ error)
    if total == 0.0:
        return 0.0
    count = np.bincount(category)
    used = count > 0
    between = float(np.sum(np.bincount(category, weights=error)[used] ** 2 / count[used]))
    chance = total * np.count_nonzero(used) / len(error)
    return max(0.0, (between - chance) / total)
