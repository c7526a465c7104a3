"""Dispatch of the public calls on the type of a profile: a winch's here, any other in its wing."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from winchkit import wings
from winchkit.arguments import require_type
from winchkit.errors import UsageError
from winchkit.schema.profiles.robot import RobotProfile
from winchkit.schema.profiles.winch import WinchProfile

Profile = WinchProfile | RobotProfile


def of_wing(call: str, profile: Profile, band: float | None) -> Callable[..., Any] | None:
    """A wing's function for its kind of profile; None for a winch. Raises UsageError for a band,
    which only the torque of a winch's motor has.
    """
    found = wings.call(call, profile)
    if found is not None and band is not None:
        raise UsageError(f"band: '{profile.name}' is no winch, and has no torque to filter")
    return found


def require_winch(profile: object) -> WinchProfile:
    """The profile; raises UsageError for anything else."""
    require_type(profile, WinchProfile, "profile")
    assert isinstance(profile, WinchProfile), "just required"
    return profile
