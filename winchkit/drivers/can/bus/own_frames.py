"""Distinguishes frames sent by this host from those of others, where the interface does not.

Most interfaces hand back nothing that was sent through them, or mark it
(:mod:`winchkit.drivers.can.bus.interface` drops that). UDP multicast hands every frame back,
unmarked.
"""

from __future__ import annotations

from collections import deque

__all__ = ["OwnFrames"]

_KEPT = 4096
"""Frames of one identifier that may be on their way back; a socket's queue holds some hundreds."""
_OVERTAKEN = 64
"""Later frames of one identifier that may come back before an earlier one."""


class OwnFrames:
    """Frames of watched identifiers that were sent here and have not come back yet.

    A frame is noted before it is sent, and taken out when it comes back: one entry for each. So a
    frame that comes back always finds its entry, whatever was lost or overtaken before it, and
    what finds none is somebody else's. An entry goes unused only where its frame is lost or could
    not be sent; it hides one frame of somebody else with the very same content, until 64 later
    ones have come back.
    """

    def __init__(self) -> None:
        """No identifier is watched."""
        self._pending: dict[int, _Pending] = {}

    def watch(self, identifier: int) -> None:
        """Note what is sent with this identifier from now on."""
        self._pending.setdefault(identifier, _Pending())

    def note(self, identifier: int, data: bytes) -> None:
        """A frame is about to be sent; on any thread."""
        pending = self._pending.get(identifier)
        if pending is not None:
            pending.frames.append(data)

    def take(self, identifier: int, data: bytes) -> bool:
        """Whether a frame that was heard is one that was sent here; on the receive thread."""
        return self._pending[identifier].take(data)


class _Pending:
    """Frames of one identifier, the oldest first."""

    def __init__(self) -> None:
        self.frames: deque[bytes] = deque(maxlen=_KEPT)
        self._overtaken = 0
        """How often the oldest has been overtaken."""

    def take(self, data: bytes) -> bool:
        try:
            place = self.frames.index(data)
        except ValueError:
            return False
        del self.frames[place]
        self._overtaken = self._overtaken + 1 if place else 0
        if self._overtaken >= _OVERTAKEN:
            self.frames.popleft()
            self._overtaken = 0
        return True
