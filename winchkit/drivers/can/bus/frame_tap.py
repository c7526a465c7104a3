"""Trace of a CAN bus for a viewer: newest frame of each identifier, and the last frames."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

_KEPT = 200
"""Frames of any identifier."""


@dataclass(frozen=True, slots=True)
class SeenFrame:
    """A frame as it was seen."""

    time: float
    """On the bench's clock, s."""
    identifier: int
    data: bytes


class FrameTap:
    """Collects frames until ``expires`` (s); cheap, for the threads that send and receive."""

    def __init__(self, expires: float) -> None:
        self.expires = expires
        self._last: deque[SeenFrame] = deque(maxlen=_KEPT)
        self._newest: dict[int, tuple[int, SeenFrame]] = {}

    def take(self, time: float, identifier: int, data: bytes) -> None:
        """Take a frame at a time on the bench's clock (s)."""
        frame = SeenFrame(time, identifier, data)
        self._last.append(frame)
        before = self._newest.get(identifier)
        self._newest[identifier] = (1 if before is None else before[0] + 1, frame)

    @property
    def last(self) -> tuple[SeenFrame, ...]:
        """The last frames, the newest one last."""
        return tuple(self._last)

    @property
    def newest(self) -> list[tuple[int, SeenFrame]]:
        """Number of frames and the newest one of each identifier."""
        return list(self._newest.values())
