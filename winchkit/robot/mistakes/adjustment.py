"""Adjustment of a robot's geometry and poses to cable lengths and positions, for one comparison.

It is smaller than a calibration, and wider: exit and anchor points, winding radii, home lengths,
the tracker's frame and the reflector are free under wide priors, so that what a calibration is for
is no mistake. Every equation has one standard deviation, and Huber's loss bounds outliers.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.robot.files.poses import Measured
from winchkit.robot.geometry.constraints import Constraint, Winding, closure, winding_of
from winchkit.robot.geometry.kinematics import Pose, lengths
from winchkit.robot.geometry.pose_estimation import start_pose
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.geometry.tracker import (
    Tracker,
    declared_tracker,
    pose_behind,
    tracked_position,
)
from winchkit.robot.identification.bundle_adjustment import (
    HUBER,
    Rows,
    Solution,
    State,
    Weights,
    solve,
)

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


@dataclass(frozen=True)
class _Unknowns:
    nominal: Array
    std: Array
    bounds: tuple[Array, Array]


@dataclass(frozen=True)
class Adjustment:
    """Equations of the adjustment; the tracker starts at its registration."""

    robot: Robot
    measured: Measured
    tracker: Tracker
    held: frozenset[str] = frozenset()
    """Unknowns that keep their values."""

    @cached_property
    def block(self) -> dict[str, NDArray[np.intp]]:
        """Indices of each kind of unknown."""
        n = len(self.robot.names)
        shapes = {
            "exit_point": (n, 3),
            "anchor_point": (n, 3),
            "winding_radius": (n,),
            "home_length": (n,),
            "tracker_frame": (6,),
            "reflector": (3,),
        }
        out: dict[str, NDArray[np.intp]] = {}
        at = 0
        for name, shape in shapes.items():
            size = int(np.prod(shape))
            out[name] = np.arange(at, at + size).reshape(shape)
            at += size
        return out

    @cached_property
    def parameters(self) -> _Unknowns:
        """The unknowns with their priors."""
        geometry, block = self.robot.geometry, self.block
        count = 1 + max(int(indices.max()) for indices in block.values())
        nominal, std = np.zeros(count), np.zeros(count)
        for name, indices in block.items():
            std[indices] = 0.0 if name in self.held else _STD[name]
        radius = np.array([winch.drum.winding_radius for winch in self.robot.winches])
        nominal[block["exit_point"]] = geometry.exit_point
        nominal[block["anchor_point"]] = geometry.anchor_point
        nominal[block["winding_radius"]] = radius
        std[block["winding_radius"]] *= radius
        nominal[block["tracker_frame"]] = [*self.tracker.shift, *self.tracker.turn]
        low = np.full(count, -np.inf)
        low[block["winding_radius"]] = _LEAST_RADIUS
        return _Unknowns(nominal, std, (low, np.full(count, np.inf)))

    @cached_property
    def _winding(self) -> Winding:
        return winding_of(self.robot.winches, self.measured.motor_angle)

    def tracker_at(self, values: Array) -> Tracker:
        """The tracker with the unknowns' values."""
        frame = values[self.block["tracker_frame"]]
        offset = self.tracker.offset + values[self.block["reflector"]]
        return replace(self.tracker, shift=frame[:3], turn=frame[3:], offset=offset)

    def constraints(self, state: State) -> Iterator[tuple[str, Constraint]]:
        """Equations of lengths and positions."""
        values, block, home = state.values, self.block, self.robot.home
        geometry = replace(
            self.robot.geometry,
            exit_point=values[block["exit_point"]],
            anchor_point=values[block["anchor_point"]],
        )
        radius = values[block["winding_radius"]]
        growth = np.array([getattr(line.drum, "growth", 0.0) for line in self.robot.lines])
        at_home = lengths(geometry, home.position, home.rotation)[0]
        by_drum = at_home + values[block["home_length"]] - self._winding.wound(radius, growth)
        found = closure(geometry, state.pose, home, by_drum, winding=self._winding, radius=radius)
        yield "closure", found
        if np.any(np.isfinite(self.measured.position)):
            tracker = self.tracker_at(values)
            seen = tracked_position(tracker, state.pose, self.measured.position)
            yield "position", replace(seen, by_pose=seen.by_pose * geometry.free)

    def rows(self, state: State) -> Iterator[Rows]:
        """The same with derivatives by the vector of unknowns."""
        for kind, found in self.constraints(state):
            out = np.zeros((*found.residual.shape, len(state.values)))
            line = np.arange(out.shape[1])
            for name, part in found.by_line.items():
                if name in self.block:
                    out[:, line[:, None] if part.ndim == 3 else line, self.block[name]] = part
            for name, part in found.by_robot.items():
                if name in self.block:
                    out[..., self.block[name]] = part
            yield Rows(kind, found.residual, found.by_pose, out)


def adjusted(adjustment: Adjustment, pose: Pose, sigma: float) -> Solution:
    """The adjustment from these poses; ``sigma``: standard deviation of an equation, m."""
    weights = Weights({"closure": sigma, "position": sigma}, robust=True)
    return solve(adjustment, State(adjustment.parameters.nominal, pose), weights)


def misfit(adjustment: Adjustment, solution: Solution, sigma: float) -> float:
    """Root mean square of the equations of the usual pose, with the priors' part, m.

    A mistake is in every pose, gross errors are in some. Infinite where an equation has no value.
    """
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


def lengths_at_home(robot: Robot, measured: Measured, sigma: float) -> Array:
    """Cable at home beyond that of the geometry, (n,), m, of positions in a known frame."""
    tracker = declared_tracker(robot.profile)
    equations = Adjustment(robot, measured, tracker, frozenset({"tracker_frame", "reflector"}))
    angles = np.full_like(measured.position, np.nan)
    shown = start_pose(measured.position, angles, robot.home, np.ones(6))
    found = adjusted(equations, robot.guided(pose_behind(tracker, shown)), sigma)
    return np.asarray(found.state.values[equations.block["home_length"]])
