"""A simulated robot as a simulated bench needs it: what its cables hang on; its wing builds it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.simbench import WinchTruth
from winchkit.sim.plant.hanging_load import Load


class SimulatedRobot(Protocol):
    """A platform, the ends of its cables, and its tracker; not thread-safe."""

    platform: Any
    """With ``position``, (3,), m, and ``count`` of cables."""
    profiles: Mapping[str, WinchProfile]
    """By winch, with the unstrained cable length at home as their reference."""
    truth: Mapping[str, WinchTruth]
    """By winch."""
    on_pose: Callable[[bytes], None] | None
    """Called with each datagram of the tracker, also in simulated time."""

    @property
    def ends(self) -> Mapping[str, Load]:
        """End of each winch's cable."""

    def advance(self, now: float) -> None:
        """Let the tracker measure and send at a time (s)."""

    def close(self) -> None:
        """Close its socket."""
