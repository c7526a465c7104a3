"""Simulated serial instruments behind a pseudo-terminal, on a separate thread."""

from __future__ import annotations

import os
import select
import sys
import tempfile
import threading
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path

from winchkit.errors import ConnectionLost
from winchkit.sim.instruments.stream import SerialCable, SimulatedStreamInstrument

_TICK = 2e-3
"""s: a conversion is sent that much late, a tenth of the period of a cell of 50 Hz."""
_JOIN = 5.0
"""s: the thread ends within a tick; longer is a defect."""
_AT_ONCE = 4096
"""Bytes: more than any command, the buffer of a pseudo-terminal."""


class SimulatedStreamLine(SerialCable):
    """One serial line with its instruments, reached at :attr:`port`.

    ``up_to_date`` is entered on this line's thread. The port is a symbolic link, which does not
    change when the line is unplugged and plugged in again.
    """

    def __init__(
        self,
        instruments: Sequence[SimulatedStreamInstrument],
        up_to_date: Callable[[], AbstractContextManager[None]],
        now: Callable[[], float],
    ) -> None:
        super().__init__(instruments, up_to_date, now)
        self._folder = tempfile.TemporaryDirectory(prefix="winchkit-")
        self.port = str(Path(self._folder.name) / "tty")
        self._ends: tuple[int, int] | None = None
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="sim-serial", daemon=True)

    def start(self) -> None:
        """Start serving; raises ConnectionLost where the system has no pseudo-terminals."""
        if sys.platform == "win32":
            self._folder.cleanup()
            raise ConnectionLost(
                "Windows has no pseudo-terminals; simulate serial instruments on Linux or macOS"
            )
        self._plug_in()
        self._thread.start()

    def stop(self) -> None:
        """Remove the port and end the thread."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join(_JOIN)
        self._unplug()
        self._folder.cleanup()

    def _plug_in(self) -> None:
        import pty
        import tty

        if self._ends is not None:
            return
        ours, theirs = pty.openpty()
        tty.setraw(theirs)
        os.set_blocking(ours, False)
        Path(self.port).symlink_to(os.ttyname(theirs))
        self._ends = ours, theirs

    def _unplug(self) -> None:
        if self._ends is None:
            return
        Path(self.port).unlink()
        for end in self._ends:
            os.close(end)
        self._ends = None

    def _run(self) -> None:
        while not self._stopping.is_set():
            self._obey_the_cable()
            if self._ends is None:
                self._stopping.wait(_TICK)
                self._serve(b"")
                continue
            ours, _ = self._ends
            ready, _, _ = select.select([ours], [], [], _TICK)
            data = self._serve(os.read(ours, _AT_ONCE) if ready else b"")
            if data:
                _write(ours, data)


def _write(end: int, data: bytes) -> None:
    """Write bytes to the line; without a reader they are lost, as on a real one."""
    try:
        os.write(end, data)
    except BlockingIOError:
        return
