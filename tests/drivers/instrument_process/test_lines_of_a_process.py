"""Lines served by threads of the bench and by the instrument process: the same to their user.

The other end is a Modbus TCP device written from the protocol's text (``modbus_peer``), or a
pseudo-terminal into which the test itself writes.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any, NamedTuple

import pytest

from modbus_peer import Peer
from waiting import until
from winchkit import catalog
from winchkit.drivers.clock import MonotonicClock
from winchkit.drivers.instrument_process.process import (
    InstrumentProcess,
    LineInstrument,
    ProcessLineSpec,
    line_of,
)
from winchkit.drivers.publisher import HostScale
from winchkit.drivers.reading import InstrumentReading, Quality
from winchkit.drivers.slow import SlowDevices
from winchkit.errors import ConnectionLost, DeviceRefused, NoReply, NotPermitted
from winchkit.schema.bench import BusSpec
from winchkit.schema.read import read_device

pytestmark = pytest.mark.realtime
CLOCK = MonotonicClock()
DEVICE = read_device(catalog.find("devices", "laumas-tlb"))


class Served(NamedTuple):
    """A line that is being served."""

    sensors: Sequence[Any]
    slow: SlowDevices
    line: Any


@pytest.fixture(params=["thread", "process"])
def how(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@contextmanager
def served(how: str, line: ProcessLineSpec) -> Iterator[Served]:
    with ExitStack() as stack:
        made: Any = line_of(line, CLOCK)
        if how == "process":
            process = InstrumentProcess(CLOCK)
            stack.callback(process.close)
            made = process.adopt(line, made)
            process.start()
            process.await_start()
        slow = SlowDevices([made])
        stack.callback(slow.close)
        yield Served(made.sensors, slow, made)


def cells(peer: Peer, *units: int, timeout: float = 0.1) -> ProcessLineSpec:
    bus = BusSpec("modbus-tcp", host="127.0.0.1", port=peer.port, timeout=timeout)
    return ProcessLineSpec(
        "cells", bus, tuple(LineInstrument(f"cell {unit}", DEVICE, unit, 100.0) for unit in units)
    )


def weigh(peer: Peer, counts: int) -> None:
    peer.registers[6] = 1 << 11
    for register in (7, 9):
        peer.registers[register], peer.registers[register + 1] = counts >> 16, counts & 0xFFFF


def test_readings_are_judged_with_calibration_tare_and_times(how: str) -> None:
    readings: list[InstrumentReading] = []
    with Peer() as peer:
        weigh(peer, 19_613)
        with served(how, cells(peer, 1)) as line:
            cell = line.sensors[0]
            assert cell.name == "cell 1"
            assert cell.period == pytest.approx(0.01)
            assert cell.max_age == pytest.approx(0.2)
            cell.publisher.scale = HostScale((1.0, 2.0), 10.0)
            cell.listeners.append(readings.append)
            until(lambda: len(readings) > 20)
            assert cell.problem is None
            assert cell.tared is False
            assert cell.host_tare == 10.0
        end = CLOCK.now()
        assert cell.counters.readings >= len(readings)
    for reading in readings:
        assert reading.gross == pytest.approx(1.0 + 2.0 * 196.13)
        assert reading.value == pytest.approx(reading.gross - 10.0)
        assert reading.raw == 19_613
        earliest = reading.t_sample - reading.t_uncertainty
        assert earliest < reading.t_request <= reading.t_receive < end
    # The device repeats one number: the host says so, from the second reading on.
    assert all(reading.quality & Quality.DUPLICATE for reading in readings[1:])
    assert cell.counters.duplicates >= len(readings) - 1
    assert 0 < cell.counters.latency.p50 < 0.1
    assert cell.counters.drops == cell.counters.timeouts == 0


def test_silence_is_counted_and_named_and_ends(how: str) -> None:
    silent = {"now": True}
    mute = lambda _u, _n, body: None if silent["now"] else (0.0, body)  # noqa: E731
    with Peer(behave=mute) as peer:
        weigh(peer, 1000)
        with served(how, cells(peer, 1, timeout=0.05)) as line:
            cell = line.sensors[0]
            until(lambda: cell.counters.timeouts >= 3)
            assert isinstance(cell.problem, NoReply)
            assert "unit 1: no answer within 0.05 s; check power" in str(cell.problem)
            assert cell.latest is None
            assert cell.counters.drops >= 3
            silent["now"] = False
            until(lambda: cell.latest is not None)
            assert cell.problem is None
            assert cell.counters.reconnects >= 2


def test_refusals_and_short_answers_are_counted(how: str) -> None:
    short = lambda _u, number, body: (0.0, body if number < 8 else bytes((3, 4)) + b"1234")  # noqa: E731
    with Peer(end=5) as peer, served(how, cells(peer, 1)) as line:
        cell = line.sensors[0]
        until(lambda: cell.counters.exceptions >= 1)
        assert isinstance(cell.problem, DeviceRefused)
        assert "illegal address" in str(cell.problem)
    with Peer(behave=short) as peer:
        weigh(peer, 1000)
        with served(how, cells(peer, 1)) as line:
            until(lambda: line.sensors[0].counters.malformed >= 1)


def test_a_lost_connection_and_a_missing_server(how: str) -> None:
    with Peer() as peer:
        weigh(peer, 1000)
        with served(how, cells(peer, 1)) as line:
            cell = line.sensors[0]
            until(lambda: cell.counters.readings > 5)
            peer.hang_up()
            until(lambda: peer.connections == 2)
            count = cell.counters.readings
            until(lambda: cell.counters.readings > count + 5)
            assert cell.counters.reconnects >= 1
    with served(how, cells(peer, 1)) as line:
        cell = line.sensors[0]
        until(lambda: cell.problem is not None)
        assert type(cell.problem) is ConnectionLost
        assert f"127.0.0.1:{peer.port}" in str(cell.problem)
        with pytest.raises(ConnectionLost, match=str(peer.port)):
            line.slow.command(cell, "zero")


def obey(peer: Peer, address: int, value: int) -> None:
    if (address, value) == (5, 7):
        peer.registers[6] |= 1 << 10


def test_commands_are_obeyed_refused_and_forbidden(how: str) -> None:
    with Peer(written=obey) as peer:
        weigh(peer, 1000)
        with served(how, cells(peer, 1)) as line:
            cell, slow = line.sensors[0], line.slow
            until(lambda: cell.latest is not None)
            sent = CLOCK.now()
            slow.command(cell, "tare")
            assert (1, 16, 5, 7) in peer.requests
            assert cell.tared, "known as soon as the command has returned"
            assert cell.latest.t_request > sent
            with pytest.raises(NotPermitted, match=r"no command .weigh.; its device file has tare"):
                slow.command(cell, "weigh")
            with pytest.raises(DeviceRefused, match=r"did not confirm it within 1 s.*'net' to go"):
                slow.command(cell, "gross")
            with pytest.raises(NotPermitted, match="EEPROM"):
                slow.command(cell, "store")
            assert (1, 16, 5, 99) not in peer.requests
            cell.may_store = True
            slow.command(cell, "store")
            assert (1, 16, 5, 99) in peer.requests
            cell.may_store = False
            with pytest.raises(NotPermitted, match="EEPROM"):
                slow.command(cell, "store")


def test_two_commands_at_a_time_reach_their_own_devices(how: str) -> None:
    with Peer() as peer:
        weigh(peer, 1000)
        with served(how, cells(peer, 1, 2)) as line:
            until(lambda: all(cell.latest is not None for cell in line.sensors))
            for cell in (line.sensors[1], line.sensors[0], line.sensors[1]):
                line.slow.command(cell, "zero")
    zeros = [unit for unit, *words in peer.requests if words == [16, 5, 8]]
    assert zeros == [2, 1, 2]


def test_identity_and_shares_of_the_line(how: str) -> None:
    with Peer(registers={0: 17, 1: 17, 2: 1, 3: 4711}) as peer:
        weigh(peer, 1000)
        with served(how, cells(peer, 1, 2)) as line:
            until(lambda: line.sensors[1].counters.readings > 3)
            found = line.slow.identify(line.sensors[0])
            assert found == {
                item.name: pytest.approx(
                    sum(peer.registers[item.register + k] << 16 * (n - 1 - k) for k in range(n))
                )
                for item in DEVICE.modbus.identity  # type: ignore[union-attr]
                if (n := 2 if item.type in {"u32", "i32"} else 1)
            }
            assert line.line.room_for(line.sensors[0]) > 100
            assert 0 < line.line.time_of(line.sensors[0]) < 0.05


def test_a_device_without_power_does_not_stop_the_other(how: str) -> None:
    dead = lambda unit, _n, body: None if unit == 2 else (0.0, body)  # noqa: E731
    with Peer(behave=dead) as peer:
        weigh(peer, 1000)
        with served(how, cells(peer, 1, 2)) as line:
            alive, silent = line.sensors
            until(lambda: silent.counters.timeouts >= 2)
            before = alive.counters.readings
            until(lambda: alive.counters.readings > before + 30)
            assert alive.counters.timeouts == alive.counters.drops == 0
            assert "unit 2" in str(silent.problem)
            assert alive.problem is None


@pytest.mark.skipif(sys.platform == "win32", reason="needs pseudo-terminals")
def test_a_serial_line_with_a_device_that_sends_by_itself(how: str) -> None:
    """A number a line; one of another form is counted and not taken."""
    device = read_device(catalog.find("devices", "hx711-line"))
    import tty

    ours, theirs = os.openpty()
    tty.setraw(theirs)
    bus = BusSpec("serial", port=os.ttyname(theirs), baudrate=115_200, timeout=0.2)
    spec = ProcessLineSpec("line", bus, (LineInstrument("cell", device, None, None),))
    readings: list[InstrumentReading] = []
    try:
        with served(how, spec) as line:
            cell = line.sensors[0]
            cell.listeners.append(readings.append)

            def send(text: bytes, enough: Callable[[], bool]) -> None:
                def sent() -> bool:
                    os.write(ours, text)
                    return enough()

                until(sent)

            send(b"-56.78\n", lambda: len(readings) >= 5)
            assert {reading.value for reading in readings} == {-56.78}
            send(b"-5x.78\n-56.78\n", lambda: cell.counters.malformed > 0)
            assert {reading.value for reading in readings} == {-56.78}
            assert isinstance(line.line.note, str)
            assert line.slow.identify(cell) == {}
    finally:
        os.close(ours)
        os.close(theirs)
