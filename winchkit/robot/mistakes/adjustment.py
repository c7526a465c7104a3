"""Adjustment of a robot's geometry and poses to cable lengths and positions, for one comparison.

It is smaller than a calibration, and wider: exit and anchor points, winding radii, home lengths,
the tracker's frame and the reflector are free under wide priors, so that what a calibration is for
is no mistake. Every equation has one standard deviation, and Huber's loss bounds outliers.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.robot.files.poses import MeasuredPoses
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.pose_estimation import start_pose
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.geometry.tracker import Tracker, declared_tracker, pose_behind
from winchkit.robot.identification.bundle_adjustment import (
    HUBER,
    BundleState,
    Solution,
    Weights,
    solve,
)
from winchkit.robot.identification.equations import RobotEquations
from winchkit.robot.identification.instruments import InstrumentValues
from winchkit.robot.identification.parameters import HOME_LENGTH, parameters_of

_STD = {
    "exit_point": 0.02,
    "anchor_point": 0.02,
    "winding_radius": 0.02,
    "home_length": 0.1,
    "tracker_frame": 1.0,
    "reflector": 0.1,
}
"""Standard deviations of the priors, m and rad; of a winding radius as a share (rules of thumb:
several times what a drawing, a tape and a rough set-up are wrong by)."""
_LEAST_RADIUS = 1e-4


def adjustment_of(
    robot: Robot, measured: MeasuredPoses, tracker: Tracker, held: frozenset[str] = frozenset()
) -> RobotEquations:
    """Equations of lengths and positions; the tracker starts at its registration, ``held`` blocks
    of parameters keep their values."""
    robot = replace(robot, profile=replace(robot.profile, effect=()))
    instruments = InstrumentValues(frozenset({"frame", "reflector"}), ("",), (tracker,))
    nothing: dict[str, Any] = {
        name: np.full_like(getattr(measured, name), np.nan)
        for name in ("angles", "swivel", "cable_length", "tension")
    }
    measured = replace(measured, **nothing)
    parameters = parameters_of(robot, measured, (HOME_LENGTH,), instruments)
    everything = list(parameters)
    for block, indices in parameters.block.items():
        radius = block == "winding_radius"
        for index in indices.ravel():
            own = everything[index]
            std = 0.0 if block in held else _STD.get(block, 0.0) * (own.nominal if radius else 1.0)
            low = _LEAST_RADIUS if radius else -np.inf
            everything[index] = replace(own, std=std, low=low, high=np.inf)
    return RobotEquations(
        robot,
        replace(parameters, all=tuple(everything)),
        measured,
        instruments,
        balanced=False,
    )


def adjusted(adjustment: RobotEquations, pose: Pose, sigma: float) -> Solution:
    """The adjustment from these poses; ``sigma``: standard deviation of an equation, m."""
    weights = Weights({"closure": sigma, "position": sigma}, robust=True)
    return solve(adjustment, BundleState(adjustment.parameters.nominal, pose), weights)


def misfit(adjustment: RobotEquations, solution: Solution, sigma: float) -> float:
    """Root mean square of the equations of the usual pose, with the priors' part, m; infinite where
    an equation has no value. A mistake is in every pose, gross errors are in some."""
    stack, measured = solution.linear.stack, adjustment.measured
    values = (measured.motor_angle, measured.position)
    count = sum(int(np.count_nonzero(np.isfinite(own))) for own in values)
    if np.count_nonzero(stack.known) < count:
        return float("inf")
    weighted = np.abs(stack.residual)
    # Beyond its scale Huber's loss has the weight scale / size.
    size = np.maximum(weighted, weighted**2 / HUBER)
    square = np.sum(size**2, axis=1) / np.maximum(np.sum(stack.known, axis=1), 1)
    of_priors = float(solution.linear.prior @ solution.linear.prior) / count
    return sigma * float(np.sqrt(np.median(square) + of_priors))


def lengths_at_home(robot: Robot, measured: MeasuredPoses, sigma: float) -> tuple[Array, float]:
    """Cable at home beyond that of the geometry, (n,), of positions in a known frame, and the
    misfit that is left with it; m."""
    tracker = declared_tracker(robot.profile)
    equations = adjustment_of(robot, measured, tracker, frozenset({"tracker_frame", "reflector"}))
    angles = np.full_like(measured.position, np.nan)
    shown = start_pose(measured.position, angles, robot.home, np.ones(6))
    found = adjusted(equations, robot.guided(pose_behind(tracker, shown)), sigma)
    lengths = np.asarray(found.state.values[equations.parameters.block["home_length"]])
    return lengths, misfit(equations, found, sigma)
