"""The robot that a bench declares, and the profiles of its winches with the cable at home."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from winchkit import catalog
from winchkit.effects.catalogue import load_catalogue
from winchkit.robot.effects.bind import robot_with_effects
from winchkit.robot.geometry.robot import Robot
from winchkit.schema.bench import BenchSpec
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.read import read_robot
from winchkit.schema.robot_bench import RobotWiring

if TYPE_CHECKING:
    from winchkit.bench.host import WinchHost
    from winchkit.bench.winch import Winch
    from winchkit.robot.bench.platform import Platform


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
        from winchkit.robot.bench.platform import Platform

        return Platform(bench, self.wiring, self.robot, winches)


def wired_robot(spec: BenchSpec) -> RobotOfBench | None:
    """The robot of a bench; None for one without ``[robot]``. Raises FileError."""
    if spec.robot is None:
        return None
    path = catalog.find("profiles", spec.robot.profile, spec.path or None)
    robot = robot_with_effects(read_robot(path), load_catalogue(spec.effect_files))
    return RobotOfBench(robot, spec.robot)
