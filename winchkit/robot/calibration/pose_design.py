"""Poses to measure next for a calibration: greedy D-optimal choice among random candidates."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from winchkit.arguments import require_type
from winchkit.arrays import Array
from winchkit.model.rotation import angles_of
from winchkit.robot.calibration.calibrate import Calibrated
from winchkit.robot.files.poses import Measured
from winchkit.robot.geometry.forward import forward
from winchkit.robot.geometry.kinematics import Pose, lengths
from winchkit.robot.geometry.robot import Robot, robot_of
from winchkit.robot.identification.bundle_adjustment import State, linearise
from winchkit.robot.identification.pose_design import (
    chosen_in_turn,
    determinant_gain,
    in_box,
    is_held,
    middle_and_half,
    random_poses,
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
        at = Pose(candidates.position[[index]], candidates.rotation[[index]])
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
    return Pose(rest.pose.position[taut], rest.pose.rotation[taut])


def _information(found: Calibrated, pose: Pose) -> Array:
    """Whitened equations of each candidate with its pose projected out, (c, r, q)."""
    equations = found.equations
    measured = _as_measured(found, pose)
    forces = replace(equations.forces, tension=measured.tension)
    there = replace(equations, measured=measured, forces=forces)
    return linearise(there, State(found.values, pose), found.weights).pose_free


def _as_measured(found: Calibrated, pose: Pose) -> Measured:
    """Placeholders for measurements: only which of them are finite is used."""
    measured, many = found.equations.measured, len(pose.position)

    def typical(values: Array) -> Array:
        known = np.any(np.isfinite(values), axis=0)
        filled = np.where(np.isfinite(values), values, 0.0).sum(axis=0)
        mean = filled / np.maximum(np.isfinite(values).sum(axis=0), 1)
        return np.tile(np.where(known, mean, np.nan), (many, 1))

    return Measured(
        _fitted_robot(found).motor_angles(pose),
        np.where(np.isfinite(typical(measured.position)), pose.position, np.nan),
        np.where(np.isfinite(typical(measured.angles)), angles_of(pose.rotation), np.nan),
        typical(measured.swivel),
        typical(measured.cable_length),
        typical(measured.tension),
        typical(measured.temperature),
        np.zeros(many, dtype=np.intp),
        np.full(many, "proposed"),
        measured.length_zeroed,
    )


def _fitted_robot(found: Calibrated) -> Robot:
    """The robot with the fitted drums, for the motor angles at a pose."""
    profile, block = found.equations.robot.profile, found.equations.parameters.block
    growth = float(found.values[block["layer_growth"][0]])
    lines = []
    for line, winch, radius in zip(
        profile.line,
        found.equations.robot.winches,
        found.values[block["winding_radius"]].tolist(),
        strict=True,
    ):
        layered = winch.drum.layer_growth is not None or winch.drum.kind in {
            "spiral",
            "archimedean",
        }
        drum = replace(winch.drum, winding_radius=radius, layer_growth=growth if layered else None)
        lines.append(replace(line, winch=replace(winch, drum=drum)))
    return robot_of(replace(profile, line=tuple(lines)))
