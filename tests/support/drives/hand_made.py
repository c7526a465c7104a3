"""An axis without a bus: frames made by hand, in time that the test lets pass."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import canopen
import pytest

from drive_on_bus import device
from winchkit.drivers.can.canopen import node as node_module
from winchkit.drivers.can.canopen.pdo import MappedObject, PdoCodec
from winchkit.drivers.can.cia402 import axis as axis_module
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.cia402.commission import Commissioned, WatchSpec
from winchkit.drivers.can.cia402.limits import DriveLimits
from winchkit.drivers.can.cia402.modes import MODES
from winchkit.drivers.can.cia402.state_machine import RequestedState
from winchkit.drivers.can.cia402.units import CountScale
from winchkit.errors import DeviceRefused
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.devices.servo import PdoSpec

NODE = 1
CYCLE = 0.004
SCALE = CountScale(angle=1e-3, velocity=1e-3, torque=1e-2)
ALL_MODES = ("PP", "PV", "PT", "HM", "IP", "CSP", "CSV", "CST")
_SIZES = {
    0x6040: (16, False),
    0x6041: (16, False),
    0x6060: (8, True),
    0x6061: (8, True),
    0x6071: (16, True),
    0x6077: (16, True),
    0x603F: (16, False),
    0x60B2: (16, True),
}


def codec(number: int, *objects: int | tuple[int, int], transmission: int = 1) -> PdoCodec:
    """A PDO of standard objects; those that are not named here are signed and of 32 bits."""
    keys = [item if isinstance(item, tuple) else (item, 0) for item in objects]
    spec = PdoSpec(number, tuple(f"0x{index:04X}:{sub}" for index, sub in keys), transmission)
    return PdoCodec(
        spec, [MappedObject(index, sub, *_SIZES.get(index, (32, True))) for index, sub in keys]
    )


class Clock:
    """Stands still until it is set or slept on."""

    def __init__(self) -> None:
        self.time = 100.0
        self.on_sleep: Callable[[], None] = lambda: None

    def now(self) -> float:
        return self.time

    def sleep(self, duration: float) -> None:
        self.time += max(0.0, duration)
        self.on_sleep()


class Bus:
    """Keeps what is sent, delivers what the test makes up."""

    name = "hand"
    sdo_timeout = 0.5

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.network = canopen.Network()
        self.handlers: dict[int, Callable[[bytes, float], None]] = {}
        self.sent: list[tuple[int, bytes]] = []
        self.beats: Counter[int] = Counter()

    def on(self, identifier: int, handler: Callable[[bytes, float], None]) -> None:
        self.handlers[identifier] = handler

    def on_foreign(self, identifier: int, handler: Callable[[bytes, float], None]) -> None:
        """Nothing that is sent comes back; who listens already goes on to."""
        before = self.handlers.get(identifier)

        def both(data: bytes, now: float) -> None:
            if before is not None:
                before(data, now)
            handler(data, now)

        self.on(identifier, both)

    def send(self, identifier: int, data: bytes) -> None:
        self.sent.append((identifier, data))

    def post(self, identifier: int, data: bytes) -> None:
        """No cycle is gathered here."""
        self.send(identifier, data)

    def deliver(self, identifier: int, data: bytes) -> None:
        handler = self.handlers.get(identifier)
        if handler is not None:
            handler(data, self.clock.time)


TPDO = (codec(1, 0x6041, 0x6064, 0x6061), codec(2, 0x606C, 0x6077, 0x603F))
RPDO = (codec(1, 0x6040, 0x60FF), codec(2, 0x607A), codec(3, 0x6071, 0x60B2), codec(4, (0x60C1, 1)))


@cache
def _device() -> DeviceSpec:
    found = device()
    assert found.servo is not None
    return replace(found, servo=replace(found.servo, encoder="absolute"))


@cache
def _dictionary(path: Path, node: int) -> Any:
    """Reading an EDS takes a tenth of a second, too long for every example of a property."""
    return canopen.import_od(str(path), node)


@dataclass
class HandMade:
    """A commissioned axis whose drive is the test."""

    mode: str = "CSV"
    tpdo: tuple[PdoCodec, ...] = TPDO
    rpdo: tuple[PdoCodec, ...] = RPDO
    clock: Clock = field(default_factory=Clock)
    sync: int = 0

    def __post_init__(self) -> None:
        self.bus = Bus(self.clock)
        watch = WatchSpec(127, 0.05, CYCLE, True, prove=False)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(node_module, "read_dictionary", _dictionary)
            self.axis = Cia402Axis(self.bus, NODE, _device(), watch, self.clock)  # type: ignore[arg-type]
        self.clock.on_sleep = lambda: self.bus.deliver(0x700 + NODE, b"\x05")
        drive = Commissioned(
            self.mode, ALL_MODES, SCALE, self.tpdo, self.rpdo, {}, DriveLimits(), CYCLE, 0
        )
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(axis_module, "await_booted", lambda *_: None)
            patch.setattr(axis_module, "commission", lambda *_: drive)
            patch.setattr(self.axis.objects, "read", lambda *_: 0)
            patch.setattr(self.axis.objects, "read_if_there", lambda *_: None)
            self.axis.commission()
        self.bus.beats[127] += 1

    def begin(self) -> None:
        """A SYNC, one cycle later."""
        self.clock.time += CYCLE
        self.sync += 1
        self.axis.begin_cycle(self.sync, self.clock.time)

    def first(self, status: int, angle: float = 0.0, mode: int = 9) -> None:
        """TPDO 1 of the drive."""
        data = struct.pack("<Hib", status, round(angle / SCALE.angle), mode)
        self.bus.deliver(0x180 + NODE, data)

    def second(self, velocity: float = 0.0, torque: float = 0.0, error: int = 0) -> None:
        """TPDO 2 of the drive."""
        counts = round(velocity / SCALE.velocity), round(torque / SCALE.torque)
        self.bus.deliver(0x280 + NODE, struct.pack("<ihH", *counts, error))

    def answer(self, status: int, **values: Any) -> None:
        """Begin a cycle that the drive answers wholly."""
        self.begin()
        self.first(status, values.pop("angle", 0.0), values.pop("mode", 9))
        self.second(**values)

    def enable(self) -> None:
        """An enabled drive with the command to stay so."""
        self.answer(0x0237, mode=MODES[self.mode].number)
        self.axis.send(RequestedState.ENABLE)
        self.sent()

    def sent(self) -> dict[int, bytes]:
        """What was sent since the last call, by identifier."""
        frames, self.bus.sent[:] = dict(self.bus.sent), []
        return frames


class Objects:
    """An object dictionary without a bus; ``refuses`` says no to a value."""

    def __init__(self, values: dict[int | tuple[int, int], int]) -> None:
        self.values = {
            key if isinstance(key, tuple) else (key, 0): value for key, value in values.items()
        }
        self.written: list[tuple[int, int, int]] = []
        self.refuses: Callable[[int, int, int], bool] = lambda _index, _sub, _value: False

    def place(self, index: int, sub: int = 0) -> str:
        return f"node 1 {index:04X}h:{sub}"

    def writes(self, index: int, sub: int) -> bool:
        return True

    def read(self, index: int, sub: int = 0) -> int:
        return self.values[index, sub]

    def read_if_there(self, index: int, sub: int = 0) -> int | None:
        return self.values.get((index, sub))

    def write(self, index: int, sub: int, value: int) -> None:
        if (index, sub) not in self.values or self.refuses(index, sub, value):
            raise DeviceRefused(f"{self.place(index, sub)}: refused {value}")
        self.values[index, sub] = value
        self.written.append((index, sub, value))

    write_verified = write

    def verify(self, index: int, sub: int, value: int) -> None:
        """Read back what was written."""
        assert self.values[index, sub] == value
