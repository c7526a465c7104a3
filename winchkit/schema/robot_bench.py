"""Contents of the table ``[robot]`` of a bench file: the platform that its winches move."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi
from typing import Annotated, ClassVar, Literal
from urllib.parse import urlsplit

from winchkit.schema.quantity import (
    Angle,
    Length,
    PositiveAcceleration,
    PositiveDuration,
    PositiveForce,
    PositiveLength,
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
    max_age: PositiveDuration = 0.1
    """Age of the newest pose at which a pose that is held by it trips the bench, s."""

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
class BodySpec(Table):
    """A box or a cylinder that no cable may come near to."""

    name: str
    position: tuple[Length, Length, Length]
    """Of its centre, m."""
    on: Literal["base", "platform"] = "base"
    """Frame of its numbers, with which it moves."""
    rotation: tuple[Angle, Angle, Angle] = (0.0, 0.0, 0.0)
    """Roll, pitch, yaw, from its own axes, rad."""
    size: tuple[PositiveLength, PositiveLength, PositiveLength] | None = None
    """Edges of a box, m."""
    radius: PositiveLength | None = None
    """Of a cylinder, m."""
    height: PositiveLength | None = None
    """Of a cylinder along its own z axis, m."""

    def rules(self) -> Iterator[Rule]:
        """It is either a box or a cylinder."""
        given = self.size is not None, self.radius is not None, self.height is not None
        if given not in ((True, False, False), (False, True, True)):
            yield "", f"'{self.name}' has either size (a box), or radius and height (a cylinder)"


@dataclass(frozen=True)
class RobotWiring(Table):
    """The robot that a bench's winches move together, with the limits of its platform, SI."""

    wing: ClassVar[str] = "robot"

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
    tension_trim: Literal["none", "end", "along"] = "none"
    """Whether the cable forces are corrected by the load cells: at the end of each motion, or all
    along it."""
    axial_stiffness: PositiveForce | None = None
    """EA of the cables in corrections of their forces, N; by default that of the profile."""
    tracker: TrackerWiring | None = None
    clearance: PositiveLength | None = None
    """Least distance of the cables from each other and from bodies, m; the first two clearances of
    a cable from its pulley and from its anchor do not count. None compares no distances."""
    body: tuple[BodySpec, ...] = ()

    def rules(self) -> Iterator[Rule]:
        """The lower tension limit lies below the upper one, and bodies have a clearance."""
        if self.body and self.clearance is None:
            yield "clearance", "is missing; it is the least distance of a cable from each body"
        low, high = self.tension
        if low >= high:
            yield "tension", f"the lower limit {low:g} N is not below the upper limit {high:g} N"
