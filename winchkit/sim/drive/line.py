"""Output of a simulated drive to its bus, and its disturbances."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

_SLOW = 0.3
"""Delay of a slow SDO answer, s."""
_STORM_PERIOD = 1e-3
"""s: 1000 EMCY messages a second, an eighth of the bus time at 1 Mbit/s."""
_STORM_CODE = 0x8120
"""CAN error passive."""


class Line:
    """Sends frames at once, late, or not at all.

    ``emergency`` sends an EMCY of a code; a storm calls it every millisecond.
    """

    def __init__(
        self, send: Callable[[int, bytes], None], emergency: Callable[[int], None]
    ) -> None:
        self._send, self._emergency = send, emergency
        self._late: deque[tuple[float, int, bytes]] = deque()
        self._storm_due = 0.0
        self.cut = False
        """Whether the cable is cut."""
        self.slow_sdo = False
        self.storm = False

    def recover(self) -> None:
        """End all lasting disturbances."""
        self.cut = self.slow_sdo = self.storm = False

    def send(self, identifier: int, data: bytes) -> None:
        """Send a frame now."""
        if not self.cut:
            self._send(identifier, data)

    def answer(self, identifier: int, data: bytes, now: float) -> None:
        """Send an answer to an SDO request."""
        if self.slow_sdo:
            self._late.append((now + _SLOW, identifier, data))
        else:
            self.send(identifier, data)

    def tick(self, now: float) -> None:
        """Send frames that are due."""
        while self._late and self._late[0][0] <= now:
            _, identifier, data = self._late.popleft()
            self.send(identifier, data)
        if self.storm and now >= self._storm_due:
            self._storm_due = now + _STORM_PERIOD
            self._emergency(_STORM_CODE)
