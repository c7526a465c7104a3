"""Contents of the table ``[robot]`` of a bench file: the platform that its winches move."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi
from typing import Annotated, Literal
from urllib.parse import urlsplit

from winchkit.schema.quantity import (
    PositiveAcceleration,
    PositiveForce,
    PositiveSpeed,
    Quantity,
)
from winchkit.schema.table import Rule, Table

LostWinch = Literal["stop-together"]
"""Declared reaction of the other winches where one is lost: all make a quick stop."""
_DEG = pi / 180


@dataclass(frozen=True)
class TrackerWiring(Table):
    """A tracker that sends poses as JSON datagrams."""

    listen: str
    """Address at which this computer receives them, ``udp://HOST:PORT``."""
    frame: str = "tracker"
    """Name of the frame in which the poses are given."""

    def rules(self) -> Iterator[Rule]:
        """The address has a host and a port."""
        try:
            parts = urlsplit(self.listen)
            complete = parts.scheme == "udp" and parts.hostname and parts.port
        except ValueError:
            complete = False
        if not complete:
            yield "listen", f"'{self.listen}' is no address such as 'udp://127.0.0.1:5100'"


@dataclass(frozen=True)
class RobotWiring(Table):
    """The robot that a bench's winches move together, with the limits of its platform, SI."""

    profile: str
    """Profile of kind ``robot``; the name of each line is that of a winch of the bench."""
    speed: PositiveSpeed
    tension: tuple[PositiveForce, PositiveForce]
    """Limits of the force distribution, N."""
    acceleration: PositiveAcceleration = 0.5
    rotation_speed: Annotated[float, Quantity("angular speed", 0.0, above=True)] = 20 * _DEG
    """rad/s."""
    rotation_acceleration: Annotated[float, Quantity("angular acceleration", 0.0, above=True)] = (
        60 * _DEG
    )
    """rad/s^2."""
    quick_stop: PositiveAcceleration | None = None
    """Deceleration of the fastest cable in a quick stop, m/s^2: 6085h of the drives, scaled at the
    beginning of each motion so that all cables stop in the same time; None leaves 6085h."""
    lost_winch: LostWinch = "stop-together"
    tension_trim: bool = False
    """Whether the cable forces are corrected at the end of each motion, by the load cells."""
    tracker: TrackerWiring | None = None

    def rules(self) -> Iterator[Rule]:
        """The lower tension limit lies below the upper one."""
        low, high = self.tension
        if low >= high:
            yield "tension", f"the lower limit {low:g} N is not below the upper limit {high:g} N"
