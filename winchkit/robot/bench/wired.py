"""The robot of a bench that is opened: profiles of its winches, and its platform."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from winchkit.robot.bench.platform import Platform
from winchkit.robot.bench.wiring import robot_of_bench
from winchkit.robot.geometry.robot import Robot
from winchkit.schema.bench import BenchSpec
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.robot_bench import RobotWiring

if TYPE_CHECKING:
    from winchkit.bench.host import WinchHost
    from winchkit.bench.winch import Winch


@dataclass(frozen=True)
class RobotOfBench:
    """A robot whose winches are those of a bench (:class:`winchkit.bench.robot.WiredRobot`)."""

    robot: Robot
    """With its effects."""
    wiring: RobotWiring

    @property
    def profiles(self) -> dict[str, WinchProfile]:
        """Profiles of the winches by line, each with its cable's length at the home pose."""
        robot = self.robot
        return {name: line.profile for name, line in zip(robot.names, robot.lines, strict=True)}

    @property
    def mass(self) -> float:
        """Mass of the platform, kg."""
        return self.robot.profile.platform.mass

    def platform(self, bench: WinchHost, winches: Mapping[str, Winch]) -> Platform:
        """The platform that the winches of an open bench move."""
        return Platform(bench, self.wiring, self.robot, winches)


def wired_robot(spec: BenchSpec) -> RobotOfBench | None:
    """The robot of a bench; None for one without ``[robot]``. Raises FileError."""
    robot = robot_of_bench(spec)
    return None if robot is None or spec.robot is None else RobotOfBench(robot, spec.robot)
