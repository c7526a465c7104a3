"""Poses of a platform as typed: ``x=0.1m,z=0.4m,yaw=5deg``."""

from __future__ import annotations

from math import degrees
from re import compile as pattern

from winchkit.cli.core.quantities import check_typed, quantity
from winchkit.errors import UsageError, suggest

COORDINATES = {
    "x": "length",
    "y": "length",
    "z": "length",
    "roll": "angle",
    "pitch": "angle",
    "yaw": "angle",
}
_BETWEEN = pattern(r",(?!\s*\d)")
"""A comma before a digit is that of a number, which is refused as such."""


def read_pose(text: str) -> dict[str, float]:
    """Coordinates that ``x=1 m,yaw=5 deg`` names, m and rad; raises UsageError."""
    found: dict[str, float] = {}
    for part in _BETWEEN.split(text):
        name, equals, value = (piece.strip() for piece in part.partition("="))
        if name not in COORDINATES or not equals:
            known = ", ".join(COORDINATES)
            raise UsageError(
                f"'{part.strip()}' is no coordinate of a pose; write such as "
                f"x=0.1m,z=40cm,yaw=5deg with {known}" + suggest(name, list(COORDINATES))
            )
        if name in found:
            raise UsageError(f"'{text}': {name} is given twice")
        check_typed(f"--pose, --pose-by: {name}", value, COORDINATES[name])
        found[name] = quantity(value, COORDINATES[name])
    return found


def pose_line(pose: dict[str, float]) -> str:
    """One line for a terminal."""
    place = ", ".join(f"{name} {pose[name]:.4f} m" for name in ("x", "y", "z"))
    turned = ", ".join(f"{name} {degrees(pose[name]):.3f} deg" for name in ("roll", "pitch", "yaw"))
    return f"platform: {place}, {turned}"
