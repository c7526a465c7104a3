"""The robot that a bench declares, and the profiles of its winches with the cable at home."""

from __future__ import annotations

from typing import TYPE_CHECKING

from winchkit import catalog
from winchkit.errors import UsageError
from winchkit.schema.bench import BenchSpec

if TYPE_CHECKING:
    from winchkit.robot.geometry.robot import Robot
    from winchkit.schema.profiles.winch import WinchProfile


def no_robot(spec: BenchSpec) -> UsageError:
    """The refusal of what needs a robot on a bench that declares none."""
    return UsageError(
        f"bench '{spec.name}' declares no robot; write a table [robot] with its profile, speed and "
        "tension (docs/formats.md)"
    )


def robot_of_bench(spec: BenchSpec) -> Robot | None:
    """The robot with its effects; None for a bench without ``[robot]``. Raises FileError."""
    if spec.robot is None:
        return None
    from winchkit.effects import load_catalogue, robot_with_effects
    from winchkit.schema.read import read_robot

    path = catalog.find("profiles", spec.robot.profile, spec.path or None)
    return robot_with_effects(read_robot(path), load_catalogue(spec.effect_files))


def line_profiles(robot: Robot) -> dict[str, WinchProfile]:
    """Profiles of the winches by line, each with its cable's length at the home pose.

    They replace those of the bench file: a calibration writes into the robot's profile.
    """
    return {name: line.profile for name, line in zip(robot.names, robot.lines, strict=True)}
