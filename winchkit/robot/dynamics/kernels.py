"""Loops of a robot's control cycle in plain Python or, from the same source, compiled by numba."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import astuple, dataclass, fields
from typing import Any

from winchkit.estimation.kernels import float_array, jit_of
from winchkit.robot.dynamics.loops_dynamics import winches_loop, wrench
from winchkit.robot.geometry.loops import CableLine, cables_loop, motors_loop, wound_angle
from winchkit.robot.geometry.loops_pose import (
    cholesky,
    find_loop,
    forces_loop,
    normal,
    straighten,
    turn,
)

Function = Callable[..., Any]


@dataclass(frozen=True)
class RobotKernels:
    """Inner loops, plain or compiled."""

    name: str
    """``plain`` or ``numba``."""
    cables: Function
    """Lines, pose → fills rows of a length and its gradient (7 n)."""
    motors: Function
    """Lines, pose, strains → fills lengths (n) and motor angles (n)."""
    find: Function
    """Lines, lengths, pose, work, last step, residual, most steps → moves the pose; steps taken, or
    −1."""
    forces: Function
    """Lines, pose, initial forces, wrench, work → fills forces (n); false where singular."""
    wrench: Function
    """Body, pose, velocity, acceleration → fills weight and inertial forces (6)."""
    winches: Function
    """Lines, rows, strains, forces, velocity, inertias, period, rates → fills angles, torques."""
    array: Callable[[list[float]], Any]
    """Makes the sequence type of these loops."""
    lines: Callable[[list[CableLine]], Any]
    """Makes the type of lines of these loops."""

    def work(self, count: int) -> tuple[Any, Any]:
        """Buffers for the rows of :attr:`cables`, and for a 6 by 6 system with its right side."""
        return self.array([0.0] * (7 * count)), self.array([0.0] * 42)


def _build(
    name: str,
    jit: Function,
    array: Callable[[list[float]], Any],
    lines: Callable[[list[CableLine]], Any],
) -> RobotKernels:
    """Build all loops, each passed through ``jit``."""
    steep, squares, solve = jit(cables_loop(True)), jit(normal), jit(cholesky)
    return RobotKernels(
        name,
        steep,
        jit(motors_loop(jit(cables_loop(False)), jit(wound_angle))),
        jit(find_loop(steep, squares, solve, jit(turn), jit(straighten))),
        jit(forces_loop(steep, squares, solve)),
        jit(wrench),
        jit(winches_loop(jit(wound_angle))),
        array,
        lines,
    )


PLAIN = _build("plain", lambda function: function, list, list)
"""Plain Python, always available."""


def compiled() -> RobotKernels:
    """Compile the loops with numba and run each once, which takes seconds.

    Raises
    ------
    UsageError
        Where numba is not installed (``pip install 'winchkit[fast]'``).
    """
    import numpy as np

    jit = jit_of("winchkit.robot.PLAIN")
    record = np.dtype([(field.name, np.float64) for field in fields(CableLine)])

    def lines(cables: list[CableLine]) -> Any:
        return np.array([astuple(cable) for cable in cables], dtype=record)

    built = _build("numba", jit, float_array, lines)
    _warm_up(built)
    return built


def _warm_up(kernels: RobotKernels) -> None:
    """Run every loop once, on six cables of any kind."""
    cable = CableLine(1, 0, 0, 0, 0, 0, 0, 0, 1, 0.01, 1, 1, 0.1, 0.001, 1, 1, 1, 0, 0)
    lines, work = kernels.lines([cable] * 6), kernels.work(6)
    pose = kernels.array([0.0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1])
    some, out = kernels.array([0.0] * 6), kernels.array([0.0] * 6)
    kernels.motors(lines, pose, some, kernels.array([0.0] * 6), out)
    kernels.forces(lines, pose, some, some, work, out)
    kernels.wrench(kernels.array([0.0] * 10), pose, some, some, kernels.array([0.0] * 6))
    rates = kernels.array([0.0] * 6)
    kernels.winches(lines, work[0], some, some, some, some, 1.0, rates, out, out)
    kernels.find(lines, out, pose, work, 1e-9, 1.0, 1)


def fastest() -> RobotKernels:
    """Compiled loops where numba is installed, else the plain ones."""
    from importlib.util import find_spec

    return compiled() if find_spec("numba") else PLAIN
