"""The robot that a bench file declares, as the bench needs it; its wing has everything else."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from winchkit import wings
from winchkit.errors import UsageError
from winchkit.schema.bench import BenchSpec
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.sim_platform import PlatformTruth


class WiredRobot(Protocol):
    """A robot whose winches are those of a bench."""

    @property
    def profiles(self) -> Mapping[str, WinchProfile]:
        """Profiles of the winches by line, each with its cable's length at the home pose.

        They replace those of the bench file: a calibration writes into the robot's profile.
        """

    @property
    def mass(self) -> float:
        """Mass of the platform, kg."""

    @property
    def truth(self) -> PlatformTruth:
        """The platform of a rehearsal, as the profile declares it."""

    def platform(self, bench: Any, winches: Mapping[str, Any]) -> Any:
        """The platform that the winches of an open bench move: ``bench.robot``."""


def robot_of_bench(spec: BenchSpec) -> WiredRobot | None:
    """The robot with its effects; None for a bench without ``[robot]``. Raises FileError."""
    if spec.robot is None:
        return None
    found: WiredRobot = wings.part("robot", "wired_robot")(spec)
    return found


def no_robot(spec: BenchSpec) -> UsageError:
    """The refusal of what needs a robot on a bench that declares none."""
    return UsageError(
        f"bench '{spec.name}' declares no robot; write a table [robot] with its profile, speed and "
        "tension (docs/formats.md)"
    )
