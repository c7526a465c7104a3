"""An axis of winchkit against the independent slave, on a bus in simulated time."""

from __future__ import annotations

import atexit
import dataclasses
import itertools
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from event_timer_eds import with_event_timer
from slave import Slave, State
from slave.rig import Rig as World
from winchkit import catalog
from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.cia402.commission import WatchSpec
from winchkit.drivers.can.cia402.state_machine import RequestedState
from winchkit.schema.bench import BusSpec
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.read import read_device
from winchkit.sim.clock.simulated_clock import SimulatedClock

HOST, HEARTBEAT, CYCLE = 127, 0.1, 0.005


@cache
def _generic() -> DeviceSpec:
    """The generic drive, whose RPDO 1 has the event timer of CiA 301 as well."""
    spec = read_device(catalog.find("devices", "generic-cia402"))
    assert spec.servo is not None
    folder = Path(tempfile.mkdtemp(prefix="winchkit-eds-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    text = (Path(spec.path).parent / spec.servo.eds).read_text()
    (folder / spec.servo.eds).write_text(with_event_timer(text))
    return dataclasses.replace(spec, path=str(folder / "device.toml"))


def generic(**servo: Any) -> DeviceSpec:
    """The generic drive, with other words of its device file."""
    spec = _generic()
    assert spec.servo is not None
    return dataclasses.replace(spec, servo=dataclasses.replace(spec.servo, **servo))


def eds_of(spec: DeviceSpec) -> Path:
    return Path(spec.path).parent / spec.servo.eds


@dataclass
class Rig:
    """Slaves, the bus as the host sees it, and its control loop in miniature."""

    slaves: list[Slave]
    world: World
    bus: CanBus
    cycle: float = CYCLE
    syncs: Iterator[int] = dataclasses.field(default_factory=lambda: itertools.count(1))

    @property
    def clock(self) -> SimulatedClock:
        return self.world.clock

    @property
    def time(self) -> float:
        return self.world.time

    def axis(self, device: DeviceSpec, node: int = 1, **watch: Any) -> Cia402Axis:
        spec = WatchSpec(HOST, HEARTBEAT, self.cycle, True, **watch)
        return Cia402Axis(self.bus, node, device, spec, self.clock)

    def cycles(
        self, axis: Cia402Axis, requested: RequestedState, count: int, **command: float
    ) -> None:
        for _ in range(count):
            axis.begin_cycle(next(self.syncs), self.time)
            self.bus.sync()
            self.bus.heartbeat(HOST, 5)
            self.world.wait(self.cycle)
            axis.send(requested, **command)

    def until_left(self, within: float, slave: int = 0) -> float:
        """Wait until a slave has left operation enabled; returns the time that it took, s."""
        start = self.time
        self.world.until(lambda: self.slaves[slave].power.state is not State.ENABLED, within)
        return self.time - start

    def moving(self, axis: Cia402Axis) -> None:
        """Enable the drive and turn its motor."""
        self.cycles(axis, RequestedState.ENABLE, 40)
        self.cycles(axis, RequestedState.ENABLE, 30, velocity=3.0)
        assert self.slaves[0].power.state is State.ENABLED
        assert abs(self.slaves[0].motor.velocity) > 2.0

    def polls(self, node: int = 1, since: float = 0.0) -> int:
        """Guarding polls of the host that came to the slaves."""
        wanted = 0x700 + node
        return sum(
            f.remote and f.identifier == wanted and at > since for at, f in self.world.frames
        )


@contextmanager
def rig(*slaves: Slave) -> Iterator[Rig]:
    world = World(Path(), list(slaves))
    spec = BusSpec("can", interface="virtual", channel=world.channel)
    bus = CanBus(spec, "can", world.clock)
    try:
        yield Rig(list(slaves), world, bus)
    finally:
        bus.close()
