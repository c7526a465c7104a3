"""winchkit's bus and axis against slaves that share no code with it, on a virtual bus."""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from slave import Slave
from slave.on_bus import SlavesOnBus
from winchkit import catalog
from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.cia402.commission import WatchSpec
from winchkit.drivers.clock import MonotonicClock
from winchkit.schema.bench import BusSpec
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.read import read_device

GENERIC = catalog.find("devices", "generic-cia402")
EDS = GENERIC.parent / "generic-cia402.eds"
HOST = 127
_BOOT = 0.1
_NUMBERS = itertools.count()


def generic(node: int = 1) -> Slave:
    """A slave of the generic EDS that stops by a ramp when its host is gone."""
    slave = Slave.from_file(EDS, node)
    slave.objects.set(0x1018, 1, 0x1234)
    slave.objects.set(0x1018, 4, 100 + node)
    return slave


@contextmanager
def opened(*slaves: Slave) -> Iterator[tuple[CanBus, SlavesOnBus]]:
    """A bus of winchkit's with these slaves on it, booted up."""
    channel = f"strangers {next(_NUMBERS)}"
    spec = BusSpec("can", interface="virtual", channel=channel)
    with SlavesOnBus(slaves, channel) as rig:
        bus = CanBus(spec, "can", MonotonicClock())
        time.sleep(_BOOT)
        try:
            yield bus, rig
        finally:
            bus.close()


def axis_on(bus: CanBus, node: int = 1, device: Path = GENERIC) -> Cia402Axis:
    """An axis of winchkit's; it is commissioned by whoever uses it."""
    watch = WatchSpec(HOST, 0.05, 0.004, brake=True, prove=False)
    spec: DeviceSpec = read_device(device)
    return Cia402Axis(bus, node, spec, watch, MonotonicClock())


class Host(threading.Thread):
    """SYNC and heartbeat of a host, as the control loop sends them, until ended."""

    def __init__(self, bus: CanBus, *axes: Cia402Axis) -> None:
        super().__init__(daemon=True)
        self._bus, self._axes = bus, axes
        self._ended = threading.Event()

    def __enter__(self) -> Host:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self.join()

    def run(self) -> None:
        clock = MonotonicClock()
        for sync in itertools.count(1):
            if self._ended.wait(0.004):
                return
            for axis in self._axes:
                axis.begin_cycle(sync, clock.now())
            if sync % 10 == 1:
                self._bus.heartbeat(HOST, 5)
            self._bus.sync()
