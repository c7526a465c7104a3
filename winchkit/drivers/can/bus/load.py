"""Worst-case load of a CAN bus by frames sent at every n-th SYNC or periodically."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from winchkit.errors import NotPermitted

ADVISED = 0.7
"""Share of a bus that cyclic traffic may take; the rest is for SDO, emergencies and repeats."""
_STEP = 1e-4
"""Cycles are whole multiples of this, as 60C2h and SYNC timers have them, s."""


@dataclass(frozen=True)
class FrameKind:
    """Frames of one identifier."""

    name: str
    size: int
    """Data bytes."""
    every: int = 0
    """Sent at every so many SYNCs; 0 for frames that do not follow SYNC."""
    period: float = 0.0
    """Of frames that do not follow SYNC, s."""

    @property
    def bits(self) -> int:
        """Worst case of one frame, bits."""
        return frame_bits(self.size)


@dataclass(frozen=True)
class BusLoad:
    """Traffic of a bus."""

    bitrate: int
    cycle: float
    """SYNC period, s."""
    frames: tuple[FrameKind, ...]

    @property
    def cyclic_bits(self) -> float:
        """Bits of an average SYNC cycle."""
        return sum(frame.bits / frame.every for frame in self.frames if frame.every)

    @property
    def other(self) -> float:
        """Share of the bus taken by frames that do not follow SYNC."""
        rest = sum(frame.bits / frame.period for frame in self.frames if not frame.every)
        return rest / self.bitrate

    @property
    def share(self) -> float:
        """Share of the bus that is taken, worst case."""
        return self.cyclic_bits / self.cycle / self.bitrate + self.other

    def fastest(self, share: float = ADVISED) -> float:
        """Shortest cycle (s), in tenths of a millisecond, that takes no more than a share.

        Raises NotPermitted where the frames that do not follow SYNC take more by themselves.
        """
        left = share - self.other
        if left <= 0:
            raise NotPermitted(
                f"heartbeats and timed frames alone take {self.other:.0%} of the bus, more than "
                f"the {share:.0%} that it may carry; make them rarer"
            )
        # The small amount keeps a cycle that fits exactly from being rounded up.
        return math.ceil(self.cyclic_bits / (left * self.bitrate) / _STEP - 1e-9) * _STEP


def frame_bits(size: int) -> int:
    """Bits of a frame with an 11-bit identifier and ``size`` data bytes, worst case.

    8n data and 47 others with interframe space; of the 34 + 8n that are stuffed, every fourth
    after the first may bring a stuff bit.
    """
    return 8 * size + 47 + (34 + 8 * size - 1) // 4


def load_of(
    bitrate: int,
    cycle: float,
    frames: Iterable[FrameKind],
    heartbeats: Mapping[str, float] | None = None,
) -> BusLoad:
    """Load of frames with SYNC and heartbeats added; those are periods (s) by who sends them."""
    beats = (
        FrameKind(f"{who} heartbeat", 1, period=period)
        for who, period in (heartbeats or {}).items()
    )
    return BusLoad(bitrate, cycle, (FrameKind("SYNC", 0, every=1), *frames, *beats))
