"""Poses at which a hanging platform rests in a wanted place, and its small oscillations there.

The cables of a hanging platform do not determine its pose: in a wanted position it rests in those
rotations where cable forces f balance the weight w, w = Gᵀ f with the derivatives G of the lengths
by the pose. Newton's method solves for the rotation and the forces at once,

    K_ω δω + Gᵀ δf = w − Gᵀ f,       K = ∂²(m g z)/∂q² + Σ fᵢ ∂²Lᵢ/∂q²,

with the least change where more than one rotation will do. With the null space N of G the
oscillations about it on inextensible cables are those of Nᵀ K N x = ω² Nᵀ M N x with the mass
matrix M; the rest is stable where all ω² are positive.

References
----------
M. Carricato, J.-P. Merlet, *Stability analysis of underconstrained cable-driven parallel robots*,
2013. E. Idà, T. Bruckmann, M. Carricato, *Rest-to-rest trajectory planning for underactuated
cable-driven parallel robots*, 2019.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.model.rotation import rotation_by
from winchkit.robot.dynamics.dynamics import mass_matrix
from winchkit.robot.geometry.hessian import length_hessian
from winchkit.robot.geometry.kinematics import Pose, by_pose, lengths, lever_of, linearised
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.geometry.wrench import gravity_wrench, weight_hessian
from winchkit.units import GRAVITY

_STEPS, _LONGEST = 30, 0.3
"""Newton steps at most (rule of thumb: six from 20 degrees away), and the longest, rad."""
_BALANCED = 1e-9
"""Wrench that is left at rest, as a share of the weight: above rounding."""
_RIDGE = 1e-12
"""Added to the unit rows of a system, where a singular one has zero."""


@dataclass(frozen=True)
class Rest:
    """Rest of a hanging platform at p wanted places."""

    pose: Pose
    """NaN where there is none near the wanted rotation."""
    force: Array
    """Of the cables, (p, n), N; NaN where there is no rest."""
    stable: NDArray[np.bool_]
    """(p,), false where there is no rest, and where a disturbance would grow."""


def rest_poses(robot: Robot, wanted: Pose) -> Rest:
    """Poses at which a hanging platform rests in wanted positions, with the rotation nearest to it.

    Parameters
    ----------
    robot : Robot
        With fewer cables than degrees of freedom, and a mass.
    wanted : Pose
        The p poses; their positions are kept, their rotations are where the search begins.

    Returns
    -------
    Rest
        Poses, forces and stability.

    Raises
    ------
    UsageError
        Without a mass, or where so few cables do not let the position be chosen.
    """
    platform, count = robot.platform, len(robot.names)
    turns = int(np.count_nonzero(robot.geometry.free[3:]))
    if platform.mass <= 0:
        raise UsageError(f"the rest of '{robot.profile.name}' needs [platform] mass above 0")
    if count + turns < robot.geometry.degrees:
        raise UsageError(
            f"{count} cables do not let the position of the platform be chosen: at least "
            f"{robot.geometry.degrees - turns} do"
        )
    pose = robot.guided(wanted)
    position, rotation = pose.position.copy(), np.array(pose.rotation)
    weight = platform.mass * GRAVITY
    force = np.full((len(position), count), weight / count)
    found = np.zeros(len(position), dtype=bool)
    going = np.arange(len(position))
    for _ in range(_STEPS):
        at = Pose(position[going], rotation[going])
        missing, step = _step(robot, at, force[going], weight)
        there = missing <= _BALANCED
        found[going[there]] = True
        left = ~there & np.isfinite(step).all(axis=1)
        going, step = going[left], step[left]
        if not len(going):
            break
        rotation[going] = rotation_by(step[:, :3]) @ rotation[going]
        force[going] += weight * step[:, 3:]
    position, rotation, force = (values[found] for values in (position, rotation, force))
    stable = np.zeros(len(found), dtype=bool)
    values, _ = _reduced(robot, Pose(position, rotation), force)
    stable[found] = np.all(values > 0, axis=1) & np.all(force > 0, axis=1)
    out = [np.full((len(found), *part.shape[1:]), np.nan) for part in (position, rotation, force)]
    for whole, part in zip(out, (position, rotation, force), strict=True):
        whole[found] = part
    return Rest(Pose(out[0], out[1]), out[2], stable)


def _step(robot: Robot, pose: Pose, force: Array, weight: float) -> tuple[Array, Array]:
    """Wrench that is left over as a share of the weight, (p,), and the step of Newton's method, a
    rotation vector and forces in weights, (p, 3 + n); NaN where a cable has no way."""
    count = force.shape[1]
    left, step = np.full(len(force), np.inf), np.full((len(force), 3 + count), np.nan)
    good = np.isfinite(lengths(robot.geometry, pose.position, pose.rotation)).all(axis=1)
    at, force = pose[good], force[good]
    scale = _scale(robot) / weight
    slope, bend = _linear(robot, at, force)
    turned = np.swapaxes(slope, 1, 2)
    missing = gravity_wrench(robot.platform, at.rotation) - (turned @ force[..., None])[..., 0]
    missing *= scale
    matrix = np.concatenate([bend[:, :, 3:], turned * weight], axis=2) * scale[:, None]
    across = np.swapaxes(matrix, 1, 2)
    square = matrix @ across + np.diag(1 - robot.geometry.free) + _RIDGE * np.eye(6)
    found = (across @ np.linalg.solve(square, missing[..., None]))[..., 0]
    size = np.linalg.norm(found[:, :3], axis=1, keepdims=True)
    left[good] = np.linalg.norm(missing, axis=1)
    step[good] = found * (_LONGEST / np.maximum(size, _LONGEST))
    return left, step


def pendulum_modes(robot: Robot, pose: Pose, force: Array) -> tuple[Array, Array]:
    """Frequencies and shapes of the small oscillations about rest, on inextensible cables.

    Parameters
    ----------
    robot : Robot
        Whose platform has a mass and, if it turns, moments of inertia.
    pose : Pose
        The p poses of rest.
    force : (p, n) array
        Cable forces there, N.

    Returns
    -------
    frequency : (p, k) array
        Hz, ascending, of the k = degrees of freedom − n motions; NaN of one that is unstable.
    shape : (p, 6, k) array
        Velocities of the origin and angular ones, base axes, of unit norm, m/s and rad/s.

    Raises
    ------
    UsageError
        Without a moment of inertia of a platform that turns.
    """
    if robot.geometry.free[3:].any() and robot.platform.inertia is None:
        raise UsageError(
            f"the oscillations of '{robot.profile.name}' need [platform] inertia; write the three "
            "principal moments about the centre of mass"
        )
    stiff, null = _reduced(robot, pose, force, eigenvalues=False)
    mass = np.swapaxes(null, 1, 2) @ mass_matrix(robot.platform, pose.rotation) @ null
    half = np.linalg.inv(np.linalg.cholesky(mass))
    values, vectors = np.linalg.eigh(half @ stiff @ np.swapaxes(half, 1, 2))
    shape = null @ np.swapaxes(half, 1, 2) @ vectors
    size = np.linalg.norm(shape, axis=1, keepdims=True)
    frequency = np.sqrt(np.where(values > 0, values, np.nan)) / (2 * np.pi)
    return frequency, shape / size


def _linear(robot: Robot, pose: Pose, force: Array) -> tuple[Array, Array]:
    """Derivatives of the lengths (p, n, 6), and of the balance (p, 6, 6), by the pose."""
    _, by = linearised(robot.geometry, pose.position, pose.rotation)
    bend = weight_hessian(robot.platform, pose.rotation) + np.einsum(
        "pn,pnij->pij", force, length_hessian(robot.geometry, pose.position, pose.rotation)
    )
    return by_pose(by), bend


def _reduced(
    robot: Robot, pose: Pose, force: Array, *, eigenvalues: bool = True
) -> tuple[Array, Array]:
    """Stiffness of the motions that keep every length, or its eigenvalues, and these motions."""
    slope, bend = _linear(robot, pose, force)
    # Guides are equations as cables are, so that what is left are the free motions.
    guides = np.broadcast_to(np.diag(1 - robot.geometry.free), (len(slope), 6, 6))
    right = np.linalg.svd(np.concatenate([slope, guides], axis=1))[2]
    count = robot.geometry.degrees - len(robot.names)
    null = np.swapaxes(right[:, 6 - count :], 1, 2)
    stiff = np.swapaxes(null, 1, 2) @ bend @ null
    return (np.linalg.eigvalsh(stiff) if eigenvalues else stiff), null


def _scale(robot: Robot) -> Array:
    """One for forces, and the reciprocal of the anchors' distance for moments, (6,)."""
    lever = lever_of(robot.geometry)
    return np.repeat([1.0, 1.0 / lever if lever > 0 else 1.0], 3)
