"""Poses to measure next for a calibration: greedy D-optimal choice among random candidates."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from winchkit.arguments import require_type
from winchkit.arrays import Array
from winchkit.model.rotation import angles_of
from winchkit.robot.calibration.calibrate import Calibrated
from winchkit.robot.geometry.forward import forward
from winchkit.robot.geometry.kinematics import Pose, lengths
from winchkit.robot.geometry.robot import robot_of
from winchkit.robot.identification.bundle_adjustment import BundleState, linearise
from winchkit.robot.identification.pose_design import (
    chosen_in_turn,
    determinant_gain,
    in_box,
    is_held,
    middle_and_half,
    random_poses,
    simulated,
)

_CANDIDATES = 400
"""Rule of thumb: of 400 random poses the best is within the best 1 % with a probability of 98 %."""
_WIDER = 1.25
"""Outer poses are the most informative; a quarter beyond those measured may still be free of
collisions, which are not checked (rule of thumb)."""
_LEAST_BOX, _LEAST_TILT = 0.02, np.radians(5.0)
"""m and rad, half sizes of the box where one pose was measured: poses that differ by less than the
noise and the play of a platform say nothing new (rule of thumb)."""
_SEED = 20
"""Any: equal data give equal proposals."""


@dataclass(frozen=True)
class NextPose:
    """Proposed pose."""

    position: tuple[float, ...]
    """m."""
    angles: tuple[float, ...]
    """Roll, pitch, yaw, rad."""
    gain: float
    """Logarithm to base 2 of the factor by which the pose reduces the volume of the confidence
    ellipsoid."""


def next_poses(found: Calibrated, count: int) -> list[NextPose]:
    """Choose poses one after another, each for the greatest gain of information.

    Parameters
    ----------
    found : Calibrated
        With the information so far.
    count : int
        Number of poses; fewer where pulling cables hold the platform at fewer candidates.

    Returns
    -------
    list of NextPose
        In the order of choice.

    Notes
    -----
    Candidates are 400 random poses in the box of positions and rotations measured so far, a quarter
    wider. Collisions are not checked. The same kinds of measurement are assumed at each.
    """
    require_type(found, Calibrated, "found")
    candidates = _candidates(found)
    parts = _information(found, candidates)
    data = found.solution.linear.information
    matrix = data + np.eye(len(data))
    angles = angles_of(candidates.rotation)
    geometry, platform = found.equations.geometry(found.values), found.equations.robot.platform
    out: list[NextPose] = []

    def add(index: int, gain: float) -> bool:
        nonlocal matrix
        at = candidates[[index]]
        if not is_held(geometry, platform, at)[0]:
            return False
        matrix = matrix + parts[index].T @ parts[index]
        place, turn = candidates.position[index], angles[index]
        out.append(NextPose(tuple(place.tolist()), tuple(turn.tolist()), gain / np.log(4)))
        return True

    chosen_in_turn(len(parts), count, lambda: determinant_gain(parts, matrix), add)
    return out


def _candidates(found: Calibrated) -> Pose:
    """Random poses in the box measured so far."""
    pose, rng = found.solution.state.pose, np.random.default_rng(_SEED)

    def spread(values: Array, least: float) -> Array:
        middle, half = middle_and_half(values)
        return in_box((middle, np.maximum(half * _WIDER, least)), _CANDIDATES, rng)

    geometry = found.equations.geometry(found.values)
    position = spread(pose.position, _LEAST_BOX)
    pose = random_poses(geometry, position, spread(angles_of(pose.rotation), _LEAST_TILT))
    pose = found.equations.robot.guided(pose)
    if len(geometry.exit_point) >= geometry.degrees:
        return pose
    # A hanging platform comes to rest near these poses, not at them.
    length = lengths(geometry, pose.position, pose.rotation)
    rest = forward(geometry, length, pose, found.equations.robot.profile.platform)
    taut = rest.converged & np.all(rest.forces > 0, axis=1)
    return rest.pose[taut]


def _information(found: Calibrated, pose: Pose) -> Array:
    """Whitened equations of each candidate with its pose projected out, (c, r, q)."""
    equations = found.equations
    known = np.isfinite(equations.measured.tension)
    total = np.where(known, equations.measured.tension, 0.0).sum(axis=0)
    mean = np.tile(total / np.maximum(known.sum(axis=0), 1), (len(pose.position), 1))
    robot = robot_of(equations.profile_at(found.values))
    there = replace(equations, measured=simulated(equations.measured, robot, pose, mean))
    return linearise(there, BundleState(found.values, pose), found.weights).pose_free
