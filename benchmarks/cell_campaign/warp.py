"""An asyncio loop whose time jumps to the next thing that is due: hours pass in seconds."""

from __future__ import annotations

import asyncio
import selectors
from typing import Any


class WarpLoop(asyncio.SelectorEventLoop):
    """Everything happens in this process, so that waiting is never waiting for somebody else."""

    def __init__(self) -> None:
        self.now = 1000.0
        super().__init__(_Jump(self))

    def time(self) -> float:
        """Simulated time, s."""
        return self.now


class WarpClock:
    """The clock of the driver: the loop's."""

    def __init__(self, loop: WarpLoop) -> None:
        self._loop = loop

    def now(self) -> float:
        """Simulated time, s."""
        return self._loop.now

    def sleep(self, duration: float) -> None:
        """Refuse."""
        raise AssertionError("nothing on the loop may block it")


class _Jump(selectors.DefaultSelector):  # type: ignore[misc, valid-type]
    """Waits for nothing: what is ready is ready, else the time is over."""

    def __init__(self, loop: WarpLoop) -> None:
        super().__init__()
        self._loop = loop

    def select(self, timeout: float | None = None) -> list[Any]:
        """What is ready; where nothing is, the time goes on by ``timeout`` at once."""
        ready = super().select(0)
        if not ready and timeout is None:
            raise AssertionError("nothing will ever happen any more")
        if not ready and timeout > 0:
            self._loop.now += timeout
        return ready
