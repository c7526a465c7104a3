"""Limits in the drive itself, a second barrier behind those of the bench."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite, nan

from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.drivers.can.cia402.units import CountScale
from winchkit.errors import NotPermitted

_U32_OFF = 0xFFFFFFFF
"""6065h and 607Fh: all bits set switch the limit off (CiA 402 for 6065h; drives do so for 607Fh).
"""


@dataclass(frozen=True)
class LimitsAtShaft:
    """Limits at the motor shaft; None leaves the drive's own limit unchanged."""

    angle: tuple[float, float] | None = None
    """Lowest and highest motor angle (607Dh), rad."""
    following_error: float | None = None
    """6065h, rad."""
    torque: float | None = None
    """Greatest of either sign (6072h), N m."""


@dataclass(frozen=True)
class DriveLimits:
    """Limits in a drive, SI at the motor shaft; NaN where it has no such object or no limit."""

    angle: tuple[float, float] = (nan, nan)
    following_error: float = nan
    torque: float = nan
    speed: float = nan


def set_limits(node: SdoNode, scale: CountScale, wanted: LimitsAtShaft) -> DriveLimits:
    """Write the given limits, read all back; raises NotPermitted without an object for one."""
    for index, sub, counts in _counts(scale, wanted):
        if node.read_if_there(index, sub) is None:
            raise NotPermitted(
                f"{node.place(index, sub)}: the drive has no such limit; leave it to the bench's"
            )
        node.write_verified(index, sub, counts)
    return read_limits(node, scale)


def read_limits(node: SdoNode, scale: CountScale) -> DriveLimits:
    """The limits as the drive has them; raises NoReply, DeviceRefused."""

    def value(index: int, sub: int, unit: float, none: int | None = None) -> float:
        counts = node.read_if_there(index, sub)
        return nan if counts is None or counts == none else counts * unit

    low, high = value(0x607D, 1, scale.angle), value(0x607D, 2, scale.angle)
    return DriveLimits(
        angle=(low, high) if low < high else (nan, nan),
        following_error=value(0x6065, 0, scale.angle, _U32_OFF),
        torque=value(0x6072, 0, scale.torque),
        speed=value(0x607F, 0, scale.velocity, _U32_OFF),
    )


def _counts(scale: CountScale, wanted: LimitsAtShaft) -> Iterator[tuple[int, int, int]]:
    """Index, sub-index and counts of everything that is to be written."""
    if wanted.angle is not None:
        low, high = sorted(wanted.angle)
        if not (isfinite(low) and isfinite(high) and low < high):
            raise NotPermitted(f"motor angles {low:g} to {high:g} rad are no limits")
        yield 0x607D, 1, scale.angle_counts(low)
        yield 0x607D, 2, scale.angle_counts(high)
    if wanted.following_error is not None:
        yield 0x6065, 0, scale.angle_counts(wanted.following_error)
    if wanted.torque is not None:
        yield 0x6072, 0, scale.torque_counts(wanted.torque)
