"""Design of further poses: candidate poses, the information of each, and their choice in turn.

Two criteria (Atkinson, Donev & Tobias, *Optimum Experimental Designs*, 2007), each greedy: the pose
with the largest gain is added, then the next.

* D-optimal, for the estimation of parameters: gain ln det(1 + X M⁻¹ Xᵀ) with the whitened rows X
  of a pose and the information matrix M so far, prior included. It is twice the logarithm of the
  factor by which the pose reduces the volume of the confidence ellipsoid.
* Noncentrality, for the discrimination of two models (Hunter & Reiner, 1965): λ = a − bᵀ C⁻¹ b with
  the information matrix [a bᵀ; b C] of the column of interest beside all nuisance columns.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.model.rotation import angles_of, rotation_of
from winchkit.robot.files.poses import MeasuredPoses
from winchkit.robot.forces.force_distribution import ForceLimits, wrench_feasibility
from winchkit.robot.geometry.kinematics import (
    Geometry,
    Pose,
    lengths,
    structure_matrix,
    swivel_angle,
)
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.geometry.wrench import gravity_wrench
from winchkit.schema.profiles.robot import PlatformSpec

_PULLING = ForceLimits(0.0, float("inf"))
_RIDGE = 1e-9
"""Added to the information of whitened, scaled nuisance columns, which may be collinear."""

Box = tuple[Array, Array]
"""Middle and half width of each coordinate, (3,) each."""


def middle_and_half(values: Array) -> Box:
    """Middle and half width of each column of (p, k)."""
    low, high = values.min(axis=0), values.max(axis=0)
    return (low + high) / 2, (high - low) / 2


def in_box(box: Box, count: int, rng: np.random.Generator) -> Array:
    """Points evenly distributed in a box, (count, 3)."""
    middle, half = box
    return np.asarray(middle + half * rng.uniform(-1, 1, (count, 3)))


def random_poses(geometry: Geometry, position: Array, angles: Array) -> Pose:
    """Poses of positions (c, 3), m, and angles (c, 3), rad, but for those with an anchor point
    inside its pulley."""
    rotation = rotation_of(*angles.T)
    sound = np.all(np.isfinite(lengths(geometry, position, rotation)), axis=1)
    return Pose(position[sound], rotation[sound])


def is_held(geometry: Geometry, platform: PlatformSpec, pose: Pose) -> NDArray[np.bool_]:
    """Whether cables that only pull balance the weight at poses, (p,); true of hanging
    platforms."""
    if len(geometry.exit_point) < geometry.degrees:
        return np.ones(len(pose.position), dtype=bool)
    structure = structure_matrix(geometry, pose.position, pose.rotation)
    pairs = zip(structure, gravity_wrench(platform, pose.rotation), strict=True)
    return np.array([wrench_feasibility(a, w, _PULLING).margin > 0 for a, w in pairs], dtype=bool)


def simulated(
    measured: MeasuredPoses,
    robot: Robot,
    pose: Pose,
    tension: Array,
    temperature: Array | float = 20.0,
) -> MeasuredPoses:
    """Measurements at poses without noise; NaN where nothing was measured so far."""
    many = len(pose.position)

    def where_known(values: Array, there: Array | float) -> Array:
        known = np.isfinite(values).any(axis=0)
        return np.where(known, np.broadcast_to(there, (many, values.shape[1])), np.nan)

    swivel = swivel_angle(robot.geometry, pose.position, pose.rotation)
    return replace(
        measured,
        motor_angle=robot.motor_angles(pose, tension=tension),
        position=where_known(measured.position, pose.position),
        angles=where_known(measured.angles, angles_of(pose.rotation)),
        swivel=where_known(measured.swivel, swivel),
        cable_length=where_known(measured.cable_length, robot.lengths(pose)),
        tension=where_known(measured.tension, tension),
        temperature=where_known(measured.temperature, temperature),
        run=np.zeros(many, dtype=np.intp),
        place=np.full(many, "proposed"),
    )


def pose_information(rows: Array, pose_of_row: NDArray[np.intp], count: int) -> Array:
    """Information matrices XᵀX of each pose, (count, k, k), of rows (r, k); −1 is the last pose."""
    out = np.zeros((count, rows.shape[1], rows.shape[1]))
    for pose in np.unique(pose_of_row):
        own = rows[pose_of_row == pose]
        out[pose] += own.T @ own
    return out


def determinant_gain(parts: Array, information: Array) -> Array:
    """Gain ln det(1 + X M⁻¹ Xᵀ) of each pose."""
    inner = parts @ np.linalg.inv(information) @ np.swapaxes(parts, 1, 2)
    return np.asarray(np.linalg.slogdet(np.eye(inner.shape[1]) + inner)[1])


def noncentrality(information: Array) -> Array:
    """Noncentrality λ of the first column where all other columns may take any size."""
    rest = information[..., 1:, 1:] + _RIDGE * np.eye(information.shape[-1] - 1)
    across = information[..., 1:, :1]
    taken = np.swapaxes(across, -1, -2) @ np.linalg.solve(rest, across)
    return np.asarray(np.maximum(information[..., 0, 0] - taken[..., 0, 0], 0.0))


def chosen_in_turn(
    candidates: int, count: int, gains: Callable[[], Array], add: Callable[[int, float], bool]
) -> None:
    """Choose poses one after another, each for the greatest gain beside those before, unless
    ``add``, given index and gain, returns False."""
    left = np.ones(candidates, dtype=bool)
    chosen = 0
    while chosen < count and np.any(left):
        now = np.where(left, gains(), -np.inf)
        best = int(np.argmax(now))
        left[best] = False
        chosen += add(best, float(now[best]))
