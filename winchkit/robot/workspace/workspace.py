"""Workspace on a grid of positions: where cables hold, restrain and move the platform.

Four conditions, each with a level that is positive where it holds:

* ``wrench-feasible``: cable forces within the limits balance the weight, and further forces and
  moments of any direction; the level is the distance of all forces from their limits, N.
* ``wrench-closure``: pulling cables can balance any wrench, if they are strong enough; the level is
  a ratio without unit (:func:`winchkit.robot.workspace.circuits.margins`).
* ``twist-feasible``: no cable is faster than its limit while the platform moves at a given speed in
  any direction and turns at one about any axis; the level is the least difference, m/s.
* ``clear``: cables keep a distance from each other and from bodies; the level is the surplus, m.

A position counts where the condition holds in all demanded rotations.

References
----------
A. Pott, *Cable-Driven Parallel Robots*, 2018, ch. 5. M. Gouttefarde, D. Daney, J.-P. Merlet,
*Interval-analysis-based determination of the wrench-feasible workspace of parallel cable-driven
robots*, 2011.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import prod

import numpy as np
from numpy.typing import NDArray

from winchkit.arguments import positive
from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.model.rotation import rotation_by
from winchkit.robot.dynamics.rest import rest_poses
from winchkit.robot.forces.force_distribution import ForceLimits
from winchkit.robot.geometry.kinematics import Pose, lever_of
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.workspace.circuits import Wrenches, margins
from winchkit.robot.workspace.distances import distances
from winchkit.schema.robot_bench import BodySpec

_PIECE = 512
"""Poses at once: with eight cables their arrays of 56 circuits are 230 KB, within the second-level
cache."""
_CELLS = 40
"""Cells of the longest edge of the box by default: 64,000 in a cube, which take about a second;
of a hanging robot, whose rest is searched in each, half of them."""
_MOST = 20_000_000
"""Poses: some minutes, and 160 MB for each level."""


@dataclass(frozen=True)
class Grid:
    """Cells of a box, and rotations of the platform in each."""

    axes: tuple[Array, Array, Array]
    """Centres of the cells along x, y and z, m."""
    step: float
    """Edge of a cell, m."""
    rotation: Array
    """From platform to base axes, (k, 3, 3)."""
    free: NDArray[np.bool_]
    """Translations of the platform, (3,); along the others there is one cell, at home."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of cells along x, y and z."""
        return tuple(len(axis) for axis in self.axes)

    @property
    def positions(self) -> Array:
        """Centres of all cells, (c, 3), m; z changes fastest."""
        return np.stack(np.meshgrid(*self.axes, indexing="ij"), axis=-1).reshape(-1, 3)

    @property
    def cell(self) -> float:
        """Volume of a cell, m³; of a planar platform its area, m²."""
        return float(self.step ** np.count_nonzero(self.free))


@dataclass(frozen=True)
class CableDemand:
    """What the cables of a robot are to do at each pose; each part may be missing."""

    tension: ForceLimits | None = None
    """Limits of the cable forces, N."""
    force: float = 0.0
    """Further force on the platform in any direction, N."""
    moment: float = 0.0
    """Further moment about the platform's origin in any direction, N m."""
    cable_speed: Array | None = None
    """Greatest speed of each cable, (n,), m/s."""
    speed: float = 0.0
    """Of the platform in any direction, m/s."""
    rotation_speed: float = 0.0
    """About any axis, rad/s."""
    clearance: float | None = None
    """Least distance of cables from each other and from bodies, m."""
    bodies: tuple[BodySpec, ...] = ()
    """Boxes and cylinders."""

    def __post_init__(self) -> None:
        """Refuse what is no magnitude; raises UsageError."""
        numbers = {
            "force": (self.force, "N"),
            "moment": (self.moment, "N m"),
            "speed": (self.speed, "m/s"),
            "rotation speed": (self.rotation_speed, "rad/s"),
            "cable speed": (0.0 if self.cable_speed is None else self.cable_speed, "m/s"),
            "clearance": (self.clearance or 0.0, "m"),
            "least tension": (0.0 if self.tension is None else self.tension.low, "N"),
        }
        for name, (value, unit) in numbers.items():
            if not np.all(np.asarray(value) >= 0.0):
                raise UsageError(f"{name} {value} {unit}: it is a magnitude; give 0 or more")


@dataclass(frozen=True)
class Workspace:
    """Levels of each condition on a grid."""

    grid: Grid
    levels: Mapping[str, Array]
    """By condition, of the shape of the grid: the least over all rotations; positive where the
    condition holds, −inf where the pose is singular or a cable has no way."""

    def inside(self, condition: str) -> NDArray[np.bool_]:
        """Cells where a condition holds.

        Parameters
        ----------
        condition : str
            One of ``levels``.

        Returns
        -------
        array of bool
            Of the shape of the grid.
        """
        return np.asarray(self.levels[condition] > 0)

    def volume(self, condition: str) -> tuple[float, float]:
        """Volume where a condition holds, and its uncertainty by the grid.

        Parameters
        ----------
        condition : str
            One of ``levels``.

        Returns
        -------
        tuple of two float
            m³, of a planar platform m². The uncertainty is half the volume of the cells inside that
            have a neighbour outside; the box of the grid bounds the volume.
        """
        inside = self.inside(condition)
        core = inside.copy()
        for axis in np.flatnonzero(self.grid.free):
            for shift in (1, -1):
                core &= np.roll(np.pad(inside, 1), shift, axis)[1:-1, 1:-1, 1:-1]
        edge = np.count_nonzero(inside & ~core)
        return float(np.count_nonzero(inside)) * self.grid.cell, float(edge * self.grid.cell / 2)

    def area(self, condition: str, index: int) -> float:
        """Area of a horizontal slice where a condition holds.

        Parameters
        ----------
        condition : str
            One of ``levels``.
        index : int
            Of the height in ``grid.axes[2]``.

        Returns
        -------
        float
            m²; of a platform in a vertical plane m.
        """
        cells = np.count_nonzero(self.inside(condition)[:, :, index])
        return float(cells * self.grid.step ** np.count_nonzero(self.grid.free[:2]))


def grid_of(
    robot: Robot,
    step: float | None = None,
    box: tuple[Array, Array] | None = None,
    turn: float = 0.0,
) -> Grid:
    """Grid of cells for a robot.

    Parameters
    ----------
    robot : Robot
        The robot.
    step : float, optional
        Edge of a cell, m; by default a fortieth of the longest edge of the box, of a hanging robot
        a twentieth.
    box : tuple of two (3,) arrays, optional
        Lowest and highest corner, m; by default :func:`usual_box`.
    turn : float
        Rotations by it either way about each axis are demanded beside that of home, rad.

    Returns
    -------
    Grid
        With one cell at home along each axis in which the platform cannot move.

    Raises
    ------
    UsageError
        For a step or a box without a cell, or with more poses than can be computed.
    """
    home, moved = robot.home.position[0], robot.geometry.free[:3] > 0
    low, high = box or usual_box(robot)
    edges = np.where(moved, high - low, 0.0)
    if not (np.isfinite(edges).all() and edges.max() > 0):
        shown = ", ".join(f"{value:.4g}" for value in edges)
        raise UsageError(
            f"the box of the workspace has edges of {shown} m; its end is not beyond "
            "its beginning along any axis in which the platform moves"
        )
    cells = _CELLS // (1 + robot.hangs)
    step = float(edges.max()) / cells if step is None else positive("workspace", "step", step)
    counts = [
        max(int(edge / step + 1e-9), 0) if free else 1
        for edge, free in zip(edges.tolist(), moved.tolist(), strict=True)
    ]
    axes = _turns(robot, turn)
    if not all(counts):
        axis = "xyz"[counts.index(0)]
        edge = float(edges[counts.index(0)])
        raise UsageError(
            f"no cell of {step:.4g} m fits along {axis}, where the box has {edge:.4g} "
            "m; give a smaller step or a larger box"
        )
    if (poses := prod(counts) * len(axes)) > _MOST:
        raise UsageError(
            f"{poses} poses of steps of {step:.4g} m are more than {_MOST}; take a "
            "larger step or a smaller box"
        )
    centres = [
        start + (edge - count * step) / 2 + step * (np.arange(count) + 0.5) if free else at[None]
        for start, edge, count, free, at in zip(low, edges, counts, moved, home, strict=True)
    ]
    x, y, z = centres
    return Grid((x, y, z), step, axes, moved)


def usual_box(robot: Robot) -> tuple[Array, Array]:
    """Lowest and highest corner (3,) of the exit points, m; all above home leave as much room
    below."""
    exits, home = robot.geometry.exit_point, robot.home.position[0]
    low, high = exits.min(axis=0), exits.max(axis=0)
    if low[2] > home[2]:
        low[2] = 2 * home[2] - high[2]
    return low, high


def _turns(robot: Robot, turn: float) -> Array:
    """Rotation of home, and those turned from it about each axis of the platform's rotations."""
    vectors = np.zeros((1, 3))
    if turn:
        axes = np.eye(3)[robot.geometry.free[3:] > 0]
        vectors = np.vstack([vectors, turn * axes, -turn * axes])
    return np.asarray(rotation_by(vectors) @ robot.home.rotation[0])


def workspace_of(robot: Robot, grid: Grid, demand: CableDemand) -> Workspace:
    """Compute the levels of all conditions that a demand has the numbers for.

    Parameters
    ----------
    robot : Robot
        One that hangs on fewer cables is considered in its poses of rest, without closure.
    grid : Grid
        Positions and rotations.
    demand : CableDemand
        Without ``tension`` there is no wrench feasibility, without ``cable_speed`` and a speed no
        twist feasibility.

    Returns
    -------
    Workspace
        Levels on the grid.

    Raises
    ------
    UsageError
        For force limits that are no range, and a hanging robot without them.
    """
    low, high = (demand.tension or ForceLimits(0.0, 1.0)).between(len(robot.names))
    names = [] if robot.hangs else ["wrench-closure"]
    if robot.hangs and demand.tension is None:
        raise UsageError(f"the workspace of '{robot.profile.name}', which hangs, needs tension")
    if demand.tension is not None:
        names.insert(0, "wrench-feasible")
    if demand.cable_speed is not None and (demand.speed or demand.rotation_speed):
        names.append("twist-feasible")
    if demand.clearance is not None:
        names.append("clear")
    positions = grid.positions
    levels = {name: np.full(len(positions), np.inf) for name in names}
    for turned in grid.rotation:
        for start in range(0, len(positions), _PIECE):
            piece = slice(start, start + _PIECE)
            place = positions[piece]
            pose = Pose(place, np.broadcast_to(turned, (len(place), 3, 3)))
            if robot.hangs:
                rest = rest_poses(robot, pose)
                pose, force = rest.pose, rest.force
            structure = robot.structure(pose)
            found = {}
            if robot.hangs:
                level = np.minimum(force - low, high - force).min(axis=1)
                found["wrench-feasible"] = np.where(rest.stable, level, -np.inf)
            else:
                levels_of = _of_wrenches(robot, pose, structure, demand, (low, high))
                found["wrench-feasible"], found["wrench-closure"] = levels_of
            if demand.cable_speed is not None:
                found["twist-feasible"] = _of_twists(structure, demand)
            if demand.clearance is not None:
                apart = distances(robot, demand.bodies, pose, demand.clearance).distance
                least = apart.min(axis=1) - demand.clearance
                found["clear"] = np.where(np.isfinite(least), least, -np.inf)
            for name in names:
                np.minimum(levels[name][piece], found[name], out=levels[name][piece])
    return Workspace(grid, {name: own.reshape(grid.shape) for name, own in levels.items()})


def _of_wrenches(
    robot: Robot, pose: Pose, structure: Array, demand: CableDemand, limits: tuple[Array, Array]
) -> tuple[Array, Array]:
    free = robot.geometry.free > 0
    spread = lever_of(robot.geometry) or 1.0
    lever = np.repeat([1.0, spread], 3)[free]
    given = Wrenches(
        structure[:, free] / lever[:, None],
        robot.weight(pose)[:, free] / lever,
        *limits,
        (demand.force, demand.moment / spread),
        int(np.count_nonzero(free[:3])),
    )
    return margins(given)


def _of_twists(structure: Array, demand: CableDemand) -> Array:
    """Least difference of a cable's limit and the speed that it needs, (p,), m/s."""
    moved, turned = (
        np.linalg.norm(structure[:, rows], axis=1) for rows in (slice(0, 3), slice(3, 6))
    )
    needed = demand.speed * moved + demand.rotation_speed * turned
    left = np.min(demand.cable_speed - needed, axis=1)
    return np.asarray(np.where(np.isfinite(left), left, -np.inf))
