"""What a profile of a cable robot declares: platform, home pose, priors and lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from winchkit.schema.quantity import Angle, Length, Mass, Number
from winchkit.schema.winch import EffectTable, WinchProfile

__all__ = ["HomeSpec", "LineSpec", "PlatformSpec", "RobotProfile"]

Point = tuple[Length, Length, Length]


@dataclass(frozen=True)
class PlatformSpec:
    """The moving platform."""

    mass: Mass = 0.0
    center_of_mass: Point = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class HomeSpec:
    """The pose at which every line has its reference motor angle."""

    position: Point
    rotation: tuple[Angle, Angle, Angle] = (0.0, 0.0, 0.0)
    """Roll, pitch, yaw; R = Rz(yaw) Ry(pitch) Rx(roll), platform to base."""


@dataclass(frozen=True)
class LineSpec:
    """One line: its winch, exit point, anchor point and swivel pulley."""

    name: str
    exit_point: Point
    anchor_point: Point
    winch: str | WinchProfile
    swivel_radius: Length = 0.0
    swivel_axis: tuple[Number, Number, Number] = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class RobotProfile:
    """A cable robot as declared; frozen, SI."""

    name: str
    home: HomeSpec
    line: tuple[LineSpec, ...]
    platform: PlatformSpec = field(default_factory=PlatformSpec)
    prior: Mapping[str, Any] = field(default_factory=dict)
    effect: tuple[EffectTable, ...] = ()
    description: str = ""
