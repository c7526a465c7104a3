"""The Modbus server of simulated instruments, read by pymodbus' client and by raw bytes."""

from __future__ import annotations

import socket
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import pytest
from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ModbusException

from winchkit.catalog import find
from winchkit.errors import ConnectionLost
from winchkit.schema.devices.modbus import ModbusSpec
from winchkit.schema.read import read_device
from winchkit.sim.instruments.modbus import ModbusInstrument
from winchkit.sim.instruments.modbus_line import SimulatedModbusLine


def spec(name: str) -> ModbusSpec:
    found = read_device(find("devices", name)).modbus
    assert found is not None
    return found


class Line:
    """A served line in a time that stands still until a query moves it by a conversion."""

    def __init__(self) -> None:
        self.force = 250.0
        self._lock = threading.Lock()
        self.cell = ModbusInstrument(spec("laumas-tlb"), lambda: self.force, now=0.0)
        length = spec("generic-length")
        fixed = replace(length, read=replace(length.read, fixed=True))
        self.length = ModbusInstrument(fixed, lambda: 2.5, now=0.0)
        self.line = SimulatedModbusLine({1: self.cell, 2: self.length}, self.up_to_date)

    @contextmanager
    def up_to_date(self) -> Iterator[None]:
        with self._lock:
            for one in (self.cell, self.length):
                for _ in range(10):
                    one.convert()
                one.show(one.next_conversion)
            yield


@pytest.fixture
def served() -> Iterator[Line]:
    line = Line()
    line.line.start()
    yield line
    line.line.stop()


@pytest.fixture
def client(served: Line) -> Iterator[ModbusTcpClient]:
    host, port = served.line.address
    found = ModbusTcpClient(host, port=port, timeout=0.5, retries=0)
    assert found.connect()
    yield found
    found.close()


def test_the_manuals_bytes_over_a_plain_socket(served: Line) -> None:
    """Function 3 from register 6, seven registers: status, gross, net, peak."""
    with socket.create_connection(served.line.address, 2.0) as wire:
        wire.sendall(bytes.fromhex("002a 0000 0006 01 03 0006 0007"))
        answer = wire.recv(256)
    head, status, gross, net, _peak = (answer[:9], *struct.unpack(">HIII", answer[9:23]))
    assert head == bytes.fromhex("002a 0000 0011 01 03 0e")
    assert (gross, net) == (25_000, 25_000)
    assert not status & (1 << 7)


def test_two_instruments_answer_by_their_units(client: ModbusTcpClient) -> None:
    assert client.read_holding_registers(9, count=2, device_id=1).registers == [0, 25_000]
    high, low = client.read_holding_registers(0, count=3, device_id=2).registers[1:]
    assert (high << 16 | low) == 250_000


def test_commands_act_on_the_device(served: Line, client: ModbusTcpClient) -> None:
    client.read_holding_registers(6, count=7, device_id=1)
    assert client.write_register(5, 7, device_id=1).exception_code == 1
    assert not client.write_registers(5, [7], device_id=1).isError()
    served.force = 300.0
    registers = client.read_holding_registers(6, count=7, device_id=1).registers
    assert registers[1:3] == [0, 30_000]
    assert registers[3:5] == [0, 5_000]
    assert not client.write_registers(5, [9], device_id=1).isError()
    assert client.write_registers(5, [4242], device_id=1).exception_code == 3
    assert client.write_registers(9, [1], device_id=1).isError()


def test_exceptions_say_what_is_wrong(client: ModbusTcpClient) -> None:
    assert client.read_holding_registers(200, count=2, device_id=1).exception_code == 2
    assert client.read_input_registers(6, count=7, device_id=1).exception_code == 1
    assert client.read_holding_registers(0, count=2, device_id=2).exception_code == 2
    assert client.read_coils(0, count=1, device_id=1).isError()
    assert not client.read_holding_registers(6, count=8, device_id=1).isError()


def test_a_unit_that_is_not_there_says_nothing(client: ModbusTcpClient) -> None:
    with pytest.raises(ModbusException):
        client.read_holding_registers(6, count=7, device_id=9)


def test_a_silent_instrument_leaves_the_others_alone(served: Line, client: ModbusTcpClient) -> None:
    served.cell.inject("silence")
    with pytest.raises(ModbusException):
        client.read_holding_registers(6, count=7, device_id=1)
    client.connect()
    assert not client.read_holding_registers(0, count=3, device_id=2).isError()
    served.cell.inject("recover")
    assert not client.read_holding_registers(6, count=7, device_id=1).isError()


def test_an_exception_on_request(served: Line, client: ModbusTcpClient) -> None:
    served.cell.inject("exception")
    assert client.read_holding_registers(6, count=7, device_id=1).exception_code == 4


def test_a_late_reply_comes_after_the_longest_reply_time(
    served: Line, client: ModbusTcpClient
) -> None:
    served.cell.inject("late reply")
    start = time.monotonic()
    assert not client.read_holding_registers(6, count=7, device_id=1).isError()
    assert time.monotonic() - start >= 0.99 * served.cell.reply_delay
    assert served.cell.reply_delay > served.cell.spec.longest_reply


def test_a_taken_port_is_refused_and_nothing_stays(served: Line) -> None:
    host, port = served.line.address
    other = SimulatedModbusLine({}, served.up_to_date, host=host, port=port)
    with pytest.raises(ConnectionLost, match=f"127.0.0.1:{port}"):
        other.start()
