"""Time stamps of an interface's own clock, mapped onto the bench's."""

from __future__ import annotations

__all__ = ["FrameTime"]

_DRIFT = 2e-4
"""At most by how much two clocks run apart."""
_LATE = 0.02
"""A frame that was read later than this tells nothing of the offset, s."""
_SET = 0.25
"""When all frames of so long come late, one of the clocks was set, s."""
_OLDEST = 0.1
"""No frame is taken to be older, s."""


class FrameTime:
    """Finds the offset between two steady clocks from the frames themselves.

    A frame is handed over some time after its stamp, and sometimes at once: the least difference
    seen is the offset, which may grow only as slowly as clocks drift. What comes out is never
    later than the reception.
    """

    def __init__(self) -> None:
        self._offset: float | None = None
        self._last = 0.0
        self._late_since: float | None = None

    def map(self, stamp: float, now: float) -> float:
        """Moment of a frame on the bench's clock, given its stamp and when it was received, s."""
        if stamp <= 0.0:
            return now
        offset = self._offset = self._learn(stamp, now)
        self._last = now
        return max(stamp + offset, now - _OLDEST)

    def _learn(self, stamp: float, now: float) -> float:
        seen = now - stamp
        if self._offset is None or seen < self._offset:
            self._late_since = None
            return seen
        late = seen - self._offset
        if late <= _LATE:
            self._late_since = None
            return self._offset + min(late, _DRIFT * max(0.0, now - self._last))
        if self._late_since is None:
            self._late_since = stamp
        if stamp - self._late_since < _SET:
            return self._offset
        self._late_since = None
        return seen
