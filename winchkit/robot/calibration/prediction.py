"""Prediction errors of a robot's model: poses by motor angles alone against measured ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.model.rotation import rotation_of, rotation_vector
from winchkit.robot.files.poses import held_unmeasured
from winchkit.robot.geometry.forward import forward
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.tracker import reading_of, registered
from winchkit.robot.identification.bundle_adjustment import BundleState, Weights, linearise, place
from winchkit.robot.identification.equations import RobotEquations

_ROUNDS = 4
"""Each multiplies the error of the lengths by the strain, at most some per cent: four reach 1e-6 of
the elongation."""
_CLEARLY_BETTER = 9.0
"""Fall of a pose's χ² from which another rotation is taken; a smaller one is no other zero."""


@dataclass(frozen=True)
class PoseErrors:
    """Predicted against measured poses."""

    distance: Array
    """(p,), m; NaN where no position was measured or no pose was found."""
    angle: Array
    """(p,), rad; NaN where the rotation was not measured whole."""
    vector: Array
    """Predicted minus measured position, (p, 3), m; NaN as above."""
    measured: Array
    """Positions as indicated by the tracker, (p, 3), m."""
    place: NDArray[np.str_]
    """Run and row of each pose, (p,)."""
    unfound: int
    """Number of poses for which the forward kinematics did not converge."""


def errors_at(
    equations: RobotEquations, values: Array, predicted: Pose | None = None
) -> PoseErrors:
    """Predict every pose from its motor angles, unless it is known already, and compare it with the
    measured one."""
    found = predicted_poses(equations, values) if predicted is None else predicted
    unfound = int(np.count_nonzero(_known(equations) & ~np.isfinite(found.position[:, 0])))
    measured = equations.measured
    pose = _reading(equations, values, found)
    held = held_unmeasured(measured, equations.robot.profile)
    vector = np.where(held, 0.0, pose.position - measured.position)
    distance = np.linalg.norm(vector, axis=1)
    angle = np.full(len(distance), np.nan)
    whole = np.all(np.isfinite(measured.angles), axis=1) & np.isfinite(pose.rotation[:, 0, 0])
    seen = np.swapaxes(rotation_of(*measured.angles[whole].T), 1, 2)
    angle[whole] = np.linalg.norm(rotation_vector(pose.rotation[whole] @ seen), axis=1)
    return PoseErrors(distance, angle, vector, measured.position, measured.place, unfound)


def cable_errors(equations: RobotEquations, values: Array, weights: Weights) -> Array:
    """Cable lengths by drums against geometry, (p, n), m, at the poses that all instruments
    determine: the held-out error of a robot whose positions are not measured."""
    # Kinds that were not fitted have unknown zeros and take no part.
    sigma = {kind: weights.sigma.get(kind, np.inf) for kind in equations.kinds}
    state = place(equations, BundleState(values, equations.start(values)), Weights(sigma))
    return next(c.residual for kind, c in equations.constraints(state) if kind == "closure")


def predicted_poses(equations: RobotEquations, values: Array, start: Pose | None = None) -> Pose:
    """Forward kinematics of the motor angles from the measured poses, else ``start``, (p,); NaN
    where none was found. Strains are found by fixed-point iteration."""
    robot = equations.robot_at(values)
    given = slack = equations.by_drum(values, robot)
    start = equations.start(values) if start is None else start
    strained = equations.parameters.law is not None and equations.middle_force is not None
    for _ in range(_ROUNDS if strained else 1):
        if (strain := equations.strain(values, robot, start)) is not None:
            given = (slack + strain.value * robot.dead_length) / (1 - strain.value)
        # Nominal numbers may be wrong by more than a robot in use: the pose that fits best.
        found = forward(
            robot.geometry, given, start, robot.platform, tolerance=np.inf, search="outlying"
        )
        # A search that did not converge starts again from home.
        start = _where(found.converged, found.pose, equations)
    return found.pose


def in_other_zeros(
    equations: RobotEquations, state: BundleState, weights: Weights
) -> tuple[BundleState, bool]:
    """The state with the poses that forward kinematics finds where these fit better, and whether
    any does. Without a measured rotation the cables close at several ones, and a pose that starts
    from the rotation at home may end in a wrong one."""
    if "rotation" in equations.kinds or "closure" not in equations.kinds:
        return state, False
    found = predicted_poses(equations, state.values)
    known = np.isfinite(found.position[:, 0])
    other = Pose(
        np.where(known[:, None], found.position, state.pose.position),
        np.where(known[:, None, None], found.rotation, state.pose.rotation),
    )
    trial = place(equations, BundleState(state.values, other), weights)
    left, before = (
        np.sum(linearise(equations, own, weights).stack.residual ** 2, axis=1)
        for own in (trial, state)
    )
    better = left < before - _CLEARLY_BETTER
    pose = Pose(
        np.where(better[:, None], trial.pose.position, state.pose.position),
        np.where(better[:, None, None], trial.pose.rotation, state.pose.rotation),
    )
    return BundleState(state.values, pose), bool(np.any(better))


def _reading(equations: RobotEquations, values: Array, pose: Pose) -> Pose:
    """Indications of the tracker at poses; an unknown frame of a session that was not fitted is
    registered on its own poses."""
    own = equations.instruments_at(values)
    if own is None:
        return pose
    measured, tracker = equations.measured, own.at(equations.measured)
    which = own.session_of(measured)
    if "frame" in own.free and np.any(which < 0):
        shift, turn = np.array(tracker.shift), np.array(tracker.turn)
        for run in np.unique(measured.run[which < 0]):
            rows = (which < 0) & (measured.run == run)
            part = pose[rows]
            seen, angles = measured.position[rows], measured.angles[rows]
            frame = registered(own.trackers[0], part, seen, angles, {"frame"})
            shift[rows], turn[rows] = frame.shift, frame.turn
        tracker = replace(tracker, shift=shift, turn=turn)
    return reading_of(tracker, pose)


def _known(equations: RobotEquations) -> NDArray[np.bool_]:
    return np.asarray(np.all(np.isfinite(equations.measured.motor_angle), axis=1))


def rms(values: Sequence[float] | Array) -> float:
    """Root of the mean square of finite values; NaN without any."""
    known = np.asarray(values)[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")


def _where(good: NDArray[np.bool_], pose: Pose, equations: RobotEquations) -> Pose:
    home = equations.robot.home
    return Pose(
        np.where(good[:, None], pose.position, home.position),
        np.where(good[:, None, None], pose.rotation, home.rotation),
    )
