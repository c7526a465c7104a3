"""A serial cable in memory: two pseudo-terminals, what is written at one end comes at the other."""

from __future__ import annotations

import os
import select
import sys
import threading

from winchkit.errors import ConnectionLost

__all__ = ["PtyCable"]

_AT_ONCE = 4096
_WAIT = 0.05


class PtyCable:
    """Two ports by path, ``near`` and ``far``, joined until closed; raises ConnectionLost."""

    def __init__(self) -> None:
        if sys.platform == "win32":
            raise ConnectionLost(
                "Windows has no pseudo-terminals; simulate Modbus over TCP there instead"
            )
        import tty

        self._masters: list[int] = []
        self._slaves: list[int] = []
        for _ in range(2):
            master, slave = os.openpty()
            tty.setraw(slave)
            self._masters.append(master)
            # Kept open, so that a client that goes away does not hang the line up.
            self._slaves.append(slave)
        self.near, self.far = (os.ttyname(slave) for slave in self._slaves)
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._pump, name="sim-cable", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Pull it out at both ends."""
        self._stopping.set()
        self._thread.join()
        for end in (*self._masters, *self._slaves):
            os.close(end)

    def _pump(self) -> None:
        first, second = self._masters
        other = {first: second, second: first}
        while not self._stopping.is_set():
            ready, _, _ = select.select(self._masters, [], [], _WAIT)
            for end in ready:
                os.write(other[end], os.read(end, _AT_ONCE))
