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
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.identification.bundle_adjustment import (
    HUBER,
    BundleState,
    Solution,
    Weights,
    solve,
)
from winchkit.robot.identification.equations import RobotEquations
from winchkit.robot.identification.instruments import InstrumentValues, declared_instruments
from winchkit.robot.identification.parameters import HOME_LENGTH, parameters_of

_STD = {
    "exit_point": 0.02,
    "anchor_point": 0.02,
    "winding_radius": 0.02,
    "home_length": 0.1,
    "tracker_frame": 1.0,
    "reflector": 0.1,
    "mounting": 1.0,
}
"""Standard deviations of the priors, m and rad; of a winding radius as a share (rules of thumb:
several times what a drawing, a tape and a rough set-up are wrong by)."""
_LEAST_RADIUS = 1e-4
"""m: bound of a fitted radius, below that of any pulley; a radius of zero is none."""
ANGLE = 0.01
"""Standard deviation of a measured angle, rad: several times that of a camera tracker."""


def adjustment_of(
    robot: Robot,
    measured: MeasuredPoses,
    instruments: InstrumentValues,
    held: frozenset[str] = frozenset(),
    *,
    turned: bool = False,
) -> RobotEquations:
    """Equations of lengths and positions, of measured rotations too where ``turned``; trackers
    start at their registration, ``held`` blocks of parameters keep their values."""
    robot = replace(robot, profile=replace(robot.profile, effect=()))
    free = {"frame", "reflector"} | ({"mounting"} if turned else set())
    instruments = replace(instruments, free=frozenset(free))
    left_out = ("swivel", "cable_length", "tension") + (() if turned else ("angles",))
    nothing: dict[str, Any] = {
        name: np.full_like(getattr(measured, name), np.nan) for name in left_out
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


def adjusted(
    adjustment: RobotEquations, pose: Pose, sigma: float, angle: float = ANGLE
) -> Solution:
    """The adjustment from these poses; ``sigma``: standard deviation of an equation, m; ``angle``:
    of a rotation, rad."""
    weights = Weights({"closure": sigma, "position": sigma, "rotation": angle}, robust=True)
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


def lengths_at_home(
    equations: RobotEquations, sigma: float
) -> tuple[Array, InstrumentValues, float]:
    """Cable at home beyond that of the geometry, (n,), the instruments with their unknown numbers
    beside it, and the misfit that is left; m."""
    own = equations.instruments or declared_instruments(equations.robot, equations.measured)
    held = {"frame": "tracker_frame", "reflector": "reflector"}
    kept = frozenset(block for name, block in held.items() if name not in own.free)
    adjustment = adjustment_of(equations.robot, equations.measured, own, kept)
    found = adjusted(adjustment, equations.start(equations.parameters.nominal), sigma)
    lengths = np.asarray(found.state.values[adjustment.parameters.block["home_length"]])
    shown = adjustment.instruments_at(found.state.values)
    assert shown is not None, "they have the tracker"
    return lengths, replace(own, trackers=shown.trackers), misfit(adjustment, found, sigma)
