"""Robots of other kinds than eight cables in space: planar, point mass, hanging."""

from __future__ import annotations

from collections.abc import Sequence

from winchkit.robot import Robot, robot_of
from winchkit.schema.profiles.robot import (
    Coordinate,
    HomeSpec,
    LineSpec,
    PlatformSpec,
    Point,
    RobotProfile,
)
from winchkit.schema.profiles.winch import DrumSpec, GearboxSpec, ReferenceSpec, WinchProfile

RADIUS, RATIO = 0.05, 30.0
WINCH = WinchProfile(
    "plain",
    DrumSpec("grooved", RADIUS, groove_pitch=0.0),
    ReferenceSpec(wound_turns=4.0),
    GearboxSpec(RATIO),
)


def small_robot(
    exits: Sequence[Point],
    anchors: Sequence[Point],
    freedom: Sequence[Coordinate],
    home: Point = (0.0, 0.0, 1.0),
    **platform: object,
) -> Robot:
    """A robot with fixed exit points and drums of one radius."""
    lines = tuple(
        LineSpec(str(n + 1), exit_point, anchor, WINCH)
        for n, (exit_point, anchor) in enumerate(zip(exits, anchors, strict=True))
    )
    spec = PlatformSpec(degrees_of_freedom=tuple(freedom), **{"mass": 4.0, **platform})  # type: ignore[arg-type]
    return robot_of(RobotProfile("small", HomeSpec(home), lines, spec))


FRAME: tuple[Point, ...] = ((-1.5, 0.0, 0.0), (1.5, 0.0, 0.0), (1.5, 0.0, 2.0), (-1.5, 0.0, 2.0))
PLATE: tuple[Point, ...] = (
    (-0.1, 0.0, 0.05),
    (0.1, 0.0, 0.05),
    (0.1, 0.0, -0.05),
    (-0.1, 0.0, -0.05),
)


def planar() -> Robot:
    """Four cables in the plane of x and z."""
    return small_robot(FRAME, PLATE, ("x", "z", "pitch"), inertia=(0.02, 0.04, 0.03))
