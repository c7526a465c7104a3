"""A control loop in miniature around the axis, stepped by the test."""

from __future__ import annotations

import time
from collections.abc import Callable
from types import TracebackType
from typing import Self

from bus_rig import HEARTBEAT, Rig
from drive_server import HOST, NODE
from winchkit import catalog
from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.cia402.commission import Commissioned, WatchSpec
from winchkit.drivers.can.cia402.state_machine import DriveState, RequestedState
from winchkit.drivers.clock import MonotonicClock
from winchkit.schema.read import read_device

_PATIENCE = 400
"""Cycles in which a drive reaches a state."""


class Master:
    """One axis on the rig's bus; a context manager."""

    def __init__(self, rig: Rig, *, prove: bool = False) -> None:
        """``prove`` the drive's watchdog at every commissioning, which takes half a second."""
        self.clock = MonotonicClock()
        self._rig = rig
        self.cycle = rig.transport.cycle
        self.bus = CanBus(rig.transport.spec, "can", self.clock)
        self.watch = WatchSpec(HOST, HEARTBEAT, self.cycle, True, prove=prove)
        device = read_device(catalog.find("devices", "generic-cia402"))
        self.axis = Cia402Axis(self.bus, NODE, device, self.watch, self.clock)
        self._count = 0
        self._due = 0.0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.bus.close()

    @property
    def state(self) -> DriveState:
        return DriveState.UNKNOWN if self.axis.feedback is None else self.axis.feedback.state

    def commission(self) -> Commissioned:
        """Commission the drive and receive its first feedback."""
        drive = self.axis.commission()
        self.cycles_silent(3)
        return drive

    def cycles_silent(self, count: int) -> None:
        """SYNC and heartbeat, without any command."""
        for _ in range(count):
            self._sync()

    def await_silently(self, condition: Callable[[], bool]) -> None:
        """Such cycles until something holds."""
        for _ in range(_PATIENCE):
            if condition():
                return
            self._sync()
        raise AssertionError("it did not come to that")

    def cycles(self, requested: RequestedState, count: int, velocity: float = 0.0) -> None:
        """Whole cycles towards a requested state."""
        for _ in range(count):
            self._sync()
            self.axis.send(requested, velocity=velocity)

    def until(self, requested: RequestedState, state: DriveState) -> None:
        """Cycles until the feedback says that the drive is in a state."""
        for _ in range(_PATIENCE):
            self.cycles(requested, 1)
            if self.state is state:
                return
        raise AssertionError(f"the drive is {self.state}, not {state}: {self._rig.drive.see()}")

    def send_word(self, word: int) -> None:
        """Write a control word past the axis, in a PDO."""
        self.bus.send(0x200 + NODE, word.to_bytes(2, "little") + bytes(4))
        self._sync()

    def _sync(self) -> None:
        """One cycle: SYNC, heartbeat where it is due, time for the answers."""
        self._count += 1
        now = self.clock.now()
        self.axis.begin_cycle(self._count, now)
        self.bus.sync()
        if now >= self._due:
            self.bus.heartbeat(HOST, 5)
            self._due = now + HEARTBEAT / 2
        time.sleep(self.cycle)
