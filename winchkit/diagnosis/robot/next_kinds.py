"""Kinds of poses that a robot may take next, imagined on its model: farther out, turned more, …"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from winchkit.diagnosis.robot.dataset import RobotDataset
from winchkit.diagnosis.robot.problem import RobotProblem
from winchkit.effects.robot_poses import Measured
from winchkit.model.robot import (
    ForceLimits,
    Pose,
    Robot,
    angles_of,
    approximate_forces,
    lengths,
    rotation_of,
    swivel_angle,
    wrench_feasibility,
)

__all__ = ["KINDS", "PoseKind", "imagined", "usable"]

Array = NDArray[np.float64]
_CANDIDATES = 60
_SEED = 20
_WIDER, _INSIDE = 2.0, 0.85
_TURNED, _MORE = np.radians(12.0), 2.0
_LEAST_BOX = 0.02
_STRONGER, _WARMER = 2.0, 15.0
_PULLING = ForceLimits(0.0, float("inf"))
_FREEDOMS = 6


@dataclass(frozen=True)
class PoseKind:
    """A kind of poses, and in what it differs from those so far."""

    name: str
    words: str
    out: bool = False
    """Farther out, as far as ropes hold inside the frame."""
    turned: bool = False
    stronger: bool = False
    """Rope forces from half to twice those so far."""
    warmer: bool = False


KINDS = (
    PoseKind("more", "as widely as so far"),
    PoseKind("turned", "turned more", turned=True),
    PoseKind("farther", "farther out", out=True),
    PoseKind("farther-turned", "farther out and turned more", out=True, turned=True),
    PoseKind("tensions", "under rope forces from half to twice those so far", stronger=True),
    PoseKind("warmth", "with the ropes 15 K colder and warmer", warmer=True),
)
"""Those that ask least of the user first."""


def usable(kind: PoseKind, dataset: RobotDataset) -> bool:
    """Whether a kind differs in something that is measured on this robot."""
    if kind.stronger and not dataset.has_tension:
        return False
    return bool(np.isfinite(dataset.measured.temperature).all()) or not kind.warmer


def imagined(problem: RobotProblem, robot: Robot, kind: PoseKind) -> tuple[Measured, Pose]:
    """What would be measured at poses of a kind, without noise, and those poses.

    Only where pulling ropes hold the platform; NaN where nothing was measured so far.
    """
    rng = np.random.default_rng(_SEED)
    pose = _placed(problem, robot, kind, rng)
    force = _forces(problem, robot, kind, pose, rng)
    good = _held(robot, pose) & np.isfinite(force).all(axis=1) & (force > 0).all(axis=1)
    if not problem.dataset.has_tension:
        good = _held(robot, pose)
    pose, force = Pose(pose.position[good], pose.rotation[good]), force[good]
    return _measured(problem.dataset, robot, kind, pose, force), pose


def _placed(problem: RobotProblem, robot: Robot, kind: PoseKind, rng: np.random.Generator) -> Pose:
    """Random poses of a kind that the geometry can take."""
    seen = problem.standing.pose
    corners = robot.geometry.exit_point
    middle, half = _middle(seen.position)
    centre = (corners.min(axis=0) + corners.max(axis=0)) / 2
    room = _INSIDE * np.ptp(corners, axis=0) / 2
    wide = np.maximum(_WIDER * half, _LEAST_BOX) if kind.out else half
    place = middle + wide * rng.uniform(-1, 1, (_CANDIDATES, 3))
    if np.all(room > 0):
        place = centre + np.clip(place - centre, -room, room)
    level, tilt = _middle(angles_of(seen.rotation))
    more = np.maximum(_MORE * tilt, _TURNED) if kind.turned else tilt
    angles = level + more * rng.uniform(-1, 1, (_CANDIDATES, 3))
    pose = Pose(place, rotation_of(*angles.T))
    sound = np.isfinite(lengths(robot.geometry, pose.position, pose.rotation)).all(axis=1)
    return Pose(pose.position[sound], pose.rotation[sound])


def _middle(values: Array) -> tuple[Array, Array]:
    """Middle and half width, column by column."""
    low, high = values.min(axis=0), values.max(axis=0)
    return (low + high) / 2, (high - low) / 2


def _held(robot: Robot, pose: Pose) -> NDArray[np.bool_]:
    """Whether ropes that only pull balance the platform's weight there."""
    if len(robot.names) < _FREEDOMS:
        return np.ones(len(pose.position), dtype=bool)
    pairs = zip(robot.structure(pose), robot.weight(pose), strict=True)
    return np.array([wrench_feasibility(a, w, _PULLING).margin > 0 for a, w in pairs], dtype=bool)


def _forces(
    problem: RobotProblem, robot: Robot, kind: PoseKind, pose: Pose, rng: np.random.Generator
) -> Array:
    """Rope forces that balance the weight, spread as those measured so far; zero without cells."""
    measured, many = problem.dataset.measured.tension, len(pose.position)
    if not problem.dataset.has_tension:
        return np.zeros((many, measured.shape[1]))
    known = measured[np.isfinite(measured).all(axis=1)]
    start = known[rng.integers(len(known), size=many)]
    if kind.stronger:
        start = start * np.exp(rng.uniform(-1, 1, (many, 1)) * np.log(_STRONGER))
    return approximate_forces(robot.structure(pose), robot.weight(pose), start)


def _measured(
    dataset: RobotDataset, robot: Robot, kind: PoseKind, pose: Pose, force: Array
) -> Measured:
    so_far, many = dataset.measured, len(pose.position)

    def where_known(values: Array, there: Array) -> Array:
        return np.where(np.isfinite(values).any(axis=0), there, np.nan)

    warm = np.nanmean(np.where(np.isfinite(so_far.temperature), so_far.temperature, 20.0))
    warmth = np.full((many, len(dataset.names)), warm)
    if kind.warmer:
        warmth += np.where(np.arange(many) % 2, _WARMER, -_WARMER)[:, None]
    length = lengths(robot.geometry, pose.position, pose.rotation)
    return replace(
        so_far,
        motor_angle=robot.motor_angles(pose, tension=force),
        position=where_known(so_far.position, pose.position),
        angles=where_known(so_far.angles, angles_of(pose.rotation)),
        swivel=where_known(
            so_far.swivel, swivel_angle(robot.geometry, pose.position, pose.rotation)
        ),
        cable_length=where_known(so_far.cable_length, length),
        tension=where_known(so_far.tension, force),
        temperature=where_known(so_far.temperature, warmth),
        run=np.zeros(many, dtype=np.intp),
        place=np.full(many, "proposed"),
    )
