"""The robot of a bench that is opened: profiles of its winches, and its platform."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from winchkit.robot.bench.platform import Platform
from winchkit.robot.bench.wiring import robot_of_bench
from winchkit.robot.geometry.kinematics import lever_of
from winchkit.robot.geometry.robot import Robot
from winchkit.schema.bench import BenchSpec
from winchkit.schema.profiles.instruments import FrameSpec
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.robot_bench import RobotWiring
from winchkit.schema.sim_platform import PlatformTruth, TrackerTruth

if TYPE_CHECKING:
    from winchkit.bench.host import WinchHost
    from winchkit.bench.winch import Winch

_STRETCH = 5e-3
"""Strain at the middle of the limits where no winch declares its stiffness: as of fibre."""


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

    @property
    def truth(self) -> PlatformTruth:
        """The platform of a rehearsal, as the profile declares it. Without a moment of inertia its
        mass is at the anchor points; cables without a stiffness have one at which the middle of
        ``tension`` stretches them by half a per cent, as of fibre."""
        profile, wiring = self.robot.profile, self.wiring
        there = 2 / 3 * lever_of(self.robot.geometry) ** 2 * self.mass
        inertia = profile.platform.inertia or (there,) * 3
        middle = sum(wiring.tension) / 2
        declared = [line.profile.cable.axial_stiffness for line in self.robot.lines]
        stiffness = min((one for one in declared if one is not None), default=middle / _STRETCH)
        frame = profile.instrument.tracker.frame
        tracker = TrackerTruth(position_noise=1e-5, rotation_noise=1e-5)
        if isinstance(frame, FrameSpec):
            tracker = replace(tracker, position=frame.position, rotation=frame.rotation)
        return PlatformTruth(inertia, stiffness, middle, damping_time=2e-3, tracker=tracker)

    def platform(self, bench: WinchHost, winches: Mapping[str, Winch]) -> Platform:
        """The platform that the winches of an open bench move."""
        return Platform(bench, self.wiring, self.robot, winches)


def wired_robot(spec: BenchSpec) -> RobotOfBench | None:
    """The robot of a bench; None for one without ``[robot]``. Raises FileError."""
    robot = robot_of_bench(spec)
    return None if robot is None or spec.robot is None else RobotOfBench(robot, spec.robot)
