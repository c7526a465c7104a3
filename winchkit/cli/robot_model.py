"""What compare, diagnose and add do where the profile is a robot's."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from winchkit.errors import Fault, FileError, UsageError

if TYPE_CHECKING:
    from winchkit.runs.run import Run
    from winchkit.schema.robot import RobotProfile
    from winchkit.schema.winch import WinchProfile

__all__ = ["read_poses_of", "read_profile", "refuse_options"]


def read_profile(path: Path) -> WinchProfile | RobotProfile:
    """The profile of a winch or of a robot. Raises FileError."""
    from winchkit.schema.read import read_any, read_winch
    from winchkit.schema.robot import RobotProfile
    from winchkit.schema.winch import WinchProfile

    value = read_any(path)
    # The reader of winches refuses every other kind in its own words.
    return value if isinstance(value, (WinchProfile, RobotProfile)) else read_winch(path)


def read_poses_of(paths: Sequence[str]) -> list[Run]:
    """Runs of a robot, all of its lines. Raises FileError with the faults of all files."""
    from winchkit.runs import read_run

    runs: list[Run] = []
    faults: list[Fault] = []
    for path in paths:
        try:
            runs.append(read_run(path))
        except FileError as error:
            faults += error.faults
    if faults:
        raise FileError(faults)
    return runs


def refuse_options(band: float | None, html: str | None, winch: str | None = None) -> None:
    """Raise UsageError for options that mean nothing for a robot's poses."""
    if band is not None:
        raise UsageError("--band: a robot's poses stand still and have no torque to filter")
    if html is not None:
        raise UsageError("--html: there is no page for robots yet; use --json or the text")
    if winch is not None:
        raise UsageError("--winch: a robot's lines are judged together; leave it out")
