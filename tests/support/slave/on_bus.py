"""Slaves on a bus of python-can, in one thread and in real time."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress

import can

from slave.frames import Frame
from slave.slave import Slave

_WAIT = 5e-4


class SlavesOnBus:
    """Runs slaves on a channel until closed; a context manager.

    Hold ``lock`` to look at a slave or to inject a fault. With a ``priority`` the thread runs under
    SCHED_FIFO where that is permitted, as a drive does not wait for the computer of its bench.
    """

    def __init__(
        self,
        slaves: Sequence[Slave],
        channel: str,
        interface: str = "virtual",
        clock: Callable[[], float] = time.monotonic,
        port: int | None = None,
        priority: int | None = None,
    ) -> None:
        self.slaves = slaves
        self.lock = threading.RLock()
        self.heard: list[tuple[float, Frame]] = []
        """Every frame from the bus with its time."""
        self._clock = clock
        self._priority = priority
        self.worst_gap = 0.0
        """Longest time between two turns of the thread, s: this computer was busy elsewhere."""
        options = {} if port is None else {"port": port}
        self._bus = can.Bus(interface=interface, channel=channel, **options)
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="slaves", daemon=True)

    def __enter__(self) -> SlavesOnBus:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopping.set()
        self._thread.join()
        self._bus.shutdown()

    def inject(self, name: str, value: object = None, slave: int = 0) -> None:
        """Set a fault of one slave."""
        with self.lock:
            self.slaves[slave].inject(name, value)

    def mend(self, name: str, slave: int = 0) -> None:
        """Take a fault of one slave back."""
        with self.lock:
            self.slaves[slave].mend(name)

    def _run(self) -> None:
        if self._priority is not None:
            with suppress(PermissionError):
                os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(self._priority))
        last = self._clock()
        while not self._stopping.is_set():
            message = self._bus.recv(_WAIT)
            with self.lock:
                now = self._clock()
                passed, last = now - last, now
                self.worst_gap = max(self.worst_gap, passed)
                for slave in self.slaves:
                    self._send(slave.advance(passed))
                if message is None or message.is_error_frame or message.is_extended_id:
                    continue
                frame = Frame(message.arbitration_id, bytes(message.data), message.is_remote_frame)
                self.heard.append((now, frame))
                for slave in self.slaves:
                    self._send(slave.receive(frame))

    def _send(self, frames: Sequence[Frame]) -> None:
        for frame in frames:
            message = can.Message(
                arbitration_id=frame.identifier, data=frame.data, is_extended_id=False
            )
            self._bus.send(message)
