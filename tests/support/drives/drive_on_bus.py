"""A simulated drive on a virtual CAN bus in real time, for tests of the drivers and the bench."""

from __future__ import annotations

import itertools
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from drive_server import DriveServer
from winchkit import catalog
from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.cia402.state_machine import RequestedState
from winchkit.drivers.clock import MonotonicClock
from winchkit.schema.bench import BusSpec
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.read import read_device

CLOCK = MonotonicClock()
_channels = itertools.count()
_syncs = itertools.count(1)


def bus_spec() -> BusSpec:
    """A virtual bus of its own."""
    channel = f"test-{os.getpid()}-{next(_channels)}"
    return BusSpec("can", interface="virtual", channel=channel, heartbeat=0.1)


def device() -> DeviceSpec:
    """The generic drive."""
    return read_device(catalog.find("devices", "generic-cia402"))


class DriveOnBus(DriveServer):
    """A drive in a thread of its own, on a virtual bus; a context manager."""

    def __init__(self, bus: BusSpec, node: int = 1, *, brake: bool = True) -> None:
        options = {"interface": "virtual", "channel": bus.channel}
        super().__init__(options, node, brake=brake, boot=0.02)

    def __enter__(self) -> DriveOnBus:
        while self.drive.nmt.name == "BOOTING":
            time.sleep(0.005)
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def shout(self, identifier: int, data: bytes) -> None:
        """Send any frame as if the drive had."""
        self._send(identifier, data)

    def words(self) -> list[int]:
        """Control words that came in RPDO 1."""
        node = self.drive.node
        return [int.from_bytes(d[:2], "little") for i, d in self.frames if i == 0x200 + node]


Driven = tuple[DriveOnBus, CanBus]


@contextmanager
def driven_bus() -> Iterator[Driven]:
    """A drive on a bus of its own, and the bench's end of that bus."""
    spec = bus_spec()
    with DriveOnBus(spec) as drive:
        bus = CanBus(spec, "can", CLOCK)
        try:
            yield drive, bus
        finally:
            bus.close()


def run_cycles(
    driven: Driven, axis: Cia402Axis, requested: RequestedState, count: int, velocity: float = 0.0
) -> set[str]:
    """Cycles of a control loop in miniature; the states that the drive went through."""
    drive, bus = driven
    seen = set()
    for _ in range(count):
        axis.begin_cycle(next(_syncs), CLOCK.now())
        bus.sync()
        bus.heartbeat(127, 5)
        time.sleep(0.005)
        seen.add(drive.drive.state.name)
        axis.send(requested, velocity=velocity)
    return seen


def run_until(
    driven: Driven,
    axis: Cia402Axis,
    requested: RequestedState,
    condition: Callable[[], bool],
    velocity: float = 0.0,
) -> set[str]:
    """Cycles until something holds, however late the thread of the drive is run."""
    seen: set[str] = set()
    for _ in range(1500):
        if condition():
            return seen
        seen |= run_cycles(driven, axis, requested, 1, velocity)
    raise AssertionError(f"it did not come to that; the drive is {axis.state}")
