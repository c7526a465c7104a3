"""The platform of a robot bench as its motor angles have it now."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from winchkit.robot.bench.wiring import robot_of_bench
from winchkit.robot.geometry.candidates import RESOLUTION
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.web.robot import pose_picture
from winchkit.schema.bench import BenchSpec

_PAUSE = 20
"""Pictures after a search in vain until the next one: a search takes up to 0.1 s of the process
that also controls, and the page asks several times a second."""


class LiveRobot:
    """The robot of a bench, and the pose that was found last, from which the next is computed."""

    def __init__(self, spec: BenchSpec) -> None:
        robot = robot_of_bench(spec)
        assert robot is not None, "the caller has looked"
        self._robot = robot
        self._last: Pose | None = None
        self._pause = 0

    def picture(self, status: Mapping[str, Any]) -> dict[str, Any] | None:
        """Pose and cables at a status; None where a motor angle is not known or fits no pose."""
        winches = [status.get("winch", {}).get(name, {}) for name in self._robot.names]
        angles, trims, tension = (
            np.array([np.nan if one.get(key) is None else one[key] for one in winches], dtype=float)
            for key in ("motor_angle", "trim_angle", "tension")
        )
        angles = angles - trims  # a correction of the forces elongates the cables: the pose stays
        if not np.isfinite(angles).all():
            return None
        forces = tension if np.isfinite(tension).all() else 0.0
        search = self._last is None and self._pause == 0
        found = self._robot.poses_at(
            angles[None, :], self._last, forces, search=RESOLUTION if search else np.inf
        )
        if not found.converged[0] or (self._last is None and not search):
            self._last = None
            self._pause = _PAUSE if search else max(self._pause - 1, 0)
            return None
        self._last = found.pose
        source = "measured" if np.isfinite(tension).all() else "none"
        return {"row": "live", **pose_picture(self._robot, found.pose, tension, source)}
