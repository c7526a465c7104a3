"""A CANopen instrument: driver against simulated node on a bus in memory, frames by hand."""

from __future__ import annotations

import dataclasses
import math
import struct
import threading
import time
import uuid
from collections.abc import Iterator
from pathlib import Path

import can
import pytest

from waiting import until
from winchkit import catalog
from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.process_value import ProcessInstrument, ProcessLine
from winchkit.drivers.clock import MonotonicClock
from winchkit.drivers.reading import Quality
from winchkit.drivers.slow import SlowDevices
from winchkit.errors import NoReply, NotPermitted
from winchkit.schema.bench import BusSpec, DeviceRef, LimitSpec, WinchWiring
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.read import read_device
from winchkit.sim.instruments.process import SimulatedProcessInstrument as SimInstrument
from winchkit.sim.live.instruments import instruments_of

CLOCK = MonotonicClock()
NODE = 5


def device() -> DeviceSpec:
    return read_device(catalog.find("devices", "generic-cia404"))


class Rig:
    """The simulated node on a thread of its own; ``seen`` are the frames of the bus."""

    def __init__(self) -> None:
        self.channel = f"process-{uuid.uuid4().hex}"
        self.force = 123.25
        self.seen: list[tuple[int, bytes]] = []
        self._port = can.Bus(interface="virtual", channel=self.channel)
        found = device()
        eds = Path(found.path).parent / found.process.eds
        self.node = SimInstrument(
            found.process, eds, NODE, lambda: self.force, self._send, now=time.monotonic()
        )
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Rig:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopping.set()
        self._thread.join()
        self._port.shutdown()

    def _send(self, identifier: int, data: bytes) -> None:
        self.seen.append((identifier, data))
        self._port.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def _run(self) -> None:
        while not self._stopping.is_set():
            message = self._port.recv(0.002)
            now = time.monotonic()
            while self.node.next_conversion <= now:
                self.node.convert()
            if message is not None:
                self.seen.append((message.arbitration_id, bytes(message.data)))
                self.node.receive(message.arbitration_id, bytes(message.data), now)
            self.node.tick(now)


@pytest.fixture
def rig() -> Iterator[Rig]:
    with Rig() as found:
        yield found


@pytest.fixture
def read(rig: Rig) -> Iterator[tuple[ProcessInstrument, SlowDevices]]:
    bus = CanBus(BusSpec("can", interface="virtual", channel=rig.channel), "can", CLOCK)
    instrument = ProcessInstrument("cell", device(), NODE, bus, CLOCK)
    slow = SlowDevices([ProcessLine("can", (instrument,), CLOCK)])
    until(lambda: instrument.latest is not None)
    yield instrument, slow
    slow.close()
    bus.close()


def test_values_come_by_tpdo_with_their_times(
    rig: Rig, read: tuple[ProcessInstrument, SlowDevices]
) -> None:
    instrument, _ = read
    until(lambda: instrument.counters.readings > 5)
    reading = instrument.latest
    assert reading.value == pytest.approx(123.25)
    assert reading.t_sample < reading.t_receive - 0.02
    assert instrument.problem is None
    sent = [data for identifier, data in rig.seen if identifier == 0x180 + NODE]
    assert struct.unpack("<fB", sent[-1]) == (123.25, 0)
    assert (0x000, bytes((0x01, NODE))) in rig.seen


def test_overload_and_a_broken_sensor_are_no_numbers(
    rig: Rig, read: tuple[ProcessInstrument, SlowDevices]
) -> None:
    instrument, _ = read
    for kind, flag in (("overload", Quality.OVERLOAD), ("sensor break", Quality.FAULT)):
        rig.node.inject(kind)
        until(lambda flag=flag: bool(instrument.latest and flag in instrument.latest.quality))  # type: ignore[misc]
        assert math.isnan(instrument.latest.value)
        rig.node.inject("recover")
        until(lambda: bool(instrument.latest and instrument.latest.quality.usable))


def test_a_silent_node_is_reported_and_set_up_again(
    rig: Rig, read: tuple[ProcessInstrument, SlowDevices]
) -> None:
    instrument, _ = read
    rig.node.inject("silence")
    until(lambda: instrument.problem is not None)
    assert isinstance(instrument.problem, NoReply)
    assert instrument.counters.timeouts >= 1
    rig.node.inject("recover")
    until(lambda: instrument.counters.reconnects >= 1)
    until(lambda: instrument.problem is None)


def test_a_node_that_reboots_sends_again(
    rig: Rig, read: tuple[ProcessInstrument, SlowDevices]
) -> None:
    instrument, _ = read
    rig.node.inject("reboot")
    until(lambda: instrument.counters.reconnects >= 1)
    count = instrument.counters.readings
    until(lambda: instrument.counters.readings > count + 3)


def test_commands_are_written_and_the_eeprom_on_purpose_only(
    rig: Rig, read: tuple[ProcessInstrument, SlowDevices]
) -> None:
    instrument, slow = read
    slow.command(instrument, "tare")
    assert any(
        identifier == 0x600 + NODE and data[1:] == bytes((0x04, 0x21, 0x00, 0xBA, 0xC1, 0, 0))
        for identifier, data in rig.seen
    )
    until(lambda: bool(instrument.latest and abs(instrument.latest.value) < 1e-3))
    with pytest.raises(NotPermitted, match="EEPROM"):
        slow.command(instrument, "store")
    with pytest.raises(NotPermitted, match="no command 'zero'; its device file has tare, store"):
        slow.command(instrument, "zero")
    assert rig.node.stored == 0
    assert slow.identify(instrument) == {"serial number": 0x1267}


def test_values_are_asked_for_where_none_are_sent(rig: Rig) -> None:
    found = device()
    assert found.process is not None
    asked = dataclasses.replace(found, process=dataclasses.replace(found.process, tpdo=()))
    bus = CanBus(BusSpec("can", interface="virtual", channel=rig.channel), "can", CLOCK)
    instrument = ProcessInstrument("cell", asked, NODE, bus, CLOCK)
    slow = SlowDevices([ProcessLine("can", (instrument,), CLOCK)])
    try:
        until(lambda: instrument.counters.readings > 3)
        assert instrument.latest.value == pytest.approx(123.25)
        assert not any(identifier == 0x180 + NODE and data for identifier, data in rig.seen[:2])
    finally:
        slow.close()
        bus.close()


def test_a_simulated_thermometer_shows_kelvin(tmp_path: Path) -> None:
    """A unit with another zero than SI's was shown without it."""
    declared = catalog.find("devices", "generic-cia404")
    process = device().process
    eds = declared.parent / process.eds
    text = declared.read_text().replace('unit = "N"', 'unit = "K"')
    warm = tmp_path / declared.name
    warm.write_text(text.replace(f'"{process.eds}"', f'"{eds.as_posix()}"'))
    ref = DeviceRef(str(warm), "can", node=NODE)
    wiring = WinchWiring("", ref, LimitSpec(1.0), temperature=ref)
    measured = {"temperature": lambda: 20.0}
    thermometer = instruments_of(wiring, "", measured, lambda *_: None, now=0.0)["temperature"]
    thermometer.convert()
    thermometer.show(1.0)
    assert thermometer.gross == pytest.approx(293.15)
