"""Which poses to measure next: those that say most of what is known least (D-optimal)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from winchkit.arrays import Array
from winchkit.calibration.robot.calibrate import Calibrated
from winchkit.calibration.robot.equations import State
from winchkit.calibration.robot.least_squares import linearise
from winchkit.model.robot import Pose, Robot, angles_of, lengths, robot_of, rotation_of
from winchkit.model.robot.force_distribution import ForceLimits, wrench_feasibility
from winchkit.model.robot.forward import forward
from winchkit.model.robot.kinematics import structure_matrix
from winchkit.runs.poses import Measured

__all__ = ["NextPose", "next_poses"]

_CANDIDATES = 400
_WIDER = 1.25
_LEAST_BOX, _LEAST_TILT = 0.02, np.radians(5.0)
_SEED = 20
_FREEDOMS = 6
_PULLING = ForceLimits(0.0, float("inf"))


@dataclass(frozen=True)
class NextPose:
    """A pose worth measuring."""

    position: tuple[float, ...]
    """m."""
    angles: tuple[float, ...]
    """Roll, pitch, yaw, rad."""
    gain: float
    """By which factor it shrinks the volume of what is uncertain, as a logarithm to base 2."""


def next_poses(found: Calibrated, count: int) -> list[NextPose]:
    """Choose ``count`` of random candidates, one after another, for the greatest gain each.

    Candidates lie in the box of positions and rotations measured so far, a quarter wider, where
    pulling ropes can hold the platform; what else is in the way is for the user to check. What is
    measured at each is what was measured. Fewer are returned where fewer can be held.
    """
    candidates = _candidates(found)
    parts = _information(found, candidates)
    data = found.solution.linear.information
    matrix = data + np.eye(len(data))
    angles = angles_of(candidates.rotation)
    out: list[NextPose] = []
    left = np.ones(len(parts), dtype=bool)
    while len(out) < count and np.any(left):
        inner = parts @ np.linalg.inv(matrix) @ np.swapaxes(parts, 1, 2)
        size = np.eye(inner.shape[1]) + inner
        gains = np.where(left, np.linalg.slogdet(size)[1], -np.inf)
        best = int(np.argmax(gains))
        left[best] = False
        if not _held(found, candidates, best):
            continue
        matrix = matrix + parts[best].T @ parts[best]
        place, turn = candidates.position[best], angles[best]
        out.append(NextPose(tuple(place.tolist()), tuple(turn.tolist()), gains[best] / np.log(4)))
    return out


def _candidates(found: Calibrated) -> Pose:
    """Random poses in the box measured, all of which the geometry can take."""
    pose, rng = found.solution.state.pose, np.random.default_rng(_SEED)

    def spread(values: Array, least: float) -> Array:
        low, high = values.min(axis=0), values.max(axis=0)
        half = np.maximum((high - low) / 2 * _WIDER, least)
        box: Array = rng.uniform(-1, 1, (_CANDIDATES, 3))
        return np.asarray((low + high) / 2 + half * box)

    position = spread(pose.position, _LEAST_BOX)
    rotation = rotation_of(*spread(angles_of(pose.rotation), _LEAST_TILT).T)
    geometry = found.equations.geometry(found.values)
    length = lengths(geometry, position, rotation)
    sound = np.all(np.isfinite(length), axis=1)
    pose = Pose(position[sound], rotation[sound])
    if len(geometry.exit_point) >= _FREEDOMS:
        return pose
    # A platform that hangs takes none of them, but comes to rest near by.
    rest = forward(geometry, length[sound], pose, found.equations.robot.profile.platform)
    taut = rest.converged & np.all(rest.forces > 0, axis=1)
    return Pose(rest.pose.position[taut], rest.pose.rotation[taut])


def _held(found: Calibrated, pose: Pose, index: int) -> bool:
    """Whether ropes that only pull balance the platform's weight at one of the poses."""
    geometry, robot = found.equations.geometry(found.values), found.equations.robot
    if len(robot.names) < _FREEDOMS:
        return True
    at = Pose(pose.position[[index]], pose.rotation[[index]])
    structure = structure_matrix(geometry, at.position, at.rotation)[0]
    margin = wrench_feasibility(structure, robot.weight(at)[0], _PULLING).margin
    return bool(margin > 0)


def _information(found: Calibrated, pose: Pose) -> Array:
    """Whitened equations of each candidate freed of its pose, (c, r, q)."""
    equations = found.equations
    measured = _as_measured(found, pose)
    forces = replace(equations.forces, tension=measured.tension)
    there = replace(equations, measured=measured, forces=forces)
    return linearise(there, State(found.values, pose), found.weights).pose_free


def _as_measured(found: Calibrated, pose: Pose) -> Measured:
    """Placeholders for what would be measured: only where there is a value counts."""
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
    """The robot with the drums found, for the angles that go with a pose."""
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
