"""What compare, diagnose and add do where the profile is a robot's."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from winchkit.errors import UsageError

if TYPE_CHECKING:
    from winchkit.schema.robot import RobotProfile
    from winchkit.schema.winch import WinchProfile

__all__ = ["read_profile", "refuse_curves", "refuse_options"]


def read_profile(path: Path) -> WinchProfile | RobotProfile:
    """The profile of a winch or of a robot. Raises FileError."""
    from winchkit.schema.read import read_any, read_winch
    from winchkit.schema.robot import RobotProfile
    from winchkit.schema.winch import WinchProfile

    value = read_any(path)
    # The reader of winches refuses every other kind in its own words.
    return value if isinstance(value, (WinchProfile, RobotProfile)) else read_winch(path)


def refuse_options(band: float | None, winch: str | None = None) -> None:
    """Raise UsageError for options that mean nothing for a robot's poses."""
    if band is not None:
        raise UsageError("--band: a robot's poses stand still and have no torque to filter")
    if winch is not None:
        raise UsageError("--winch: a robot's lines are judged together; leave it out")


def refuse_curves(declared: WinchProfile | RobotProfile) -> None:
    """Raise UsageError for a robot's profile where a curve along a winch's run is asked for."""
    from winchkit.schema.robot import RobotProfile

    if isinstance(declared, RobotProfile):
        raise UsageError(
            f"'{declared.name}' is a robot: there is no curve to begin from along its poses. "
            "'winchkit diagnose' says over what the rest lives; write the effect by hand, as "
            "examples/my_effect.py, with on_robot, and give it with --effects"
        )
