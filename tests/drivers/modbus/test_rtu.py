"""Modbus RTU over a pseudo-terminal, answered by a device written from the protocol's text."""

from __future__ import annotations

import os
import select
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from modbus_peers.faulty_line import crc
from winchkit import catalog
from winchkit.drivers.clock import MonotonicClock
from winchkit.drivers.modbus.instrument import Instrument
from winchkit.drivers.modbus.line import ModbusLine
from winchkit.drivers.slow import SlowDevices
from winchkit.schema.bench import BusSpec
from winchkit.schema.read import read_device

pytestmark = pytest.mark.skipif(os.name != "posix", reason="pseudo-terminals")

CLOCK = MonotonicClock()
Behaviour = Callable[[int, bytes], tuple[float, bytes]]


def answer(request: bytes) -> bytes:
    """Status stable, gross and net 12345 counts; as many registers as were asked for."""
    count = int.from_bytes(request[4:6], "big")
    words = ([1 << 11, 0, 12345, 0, 12345] + [0] * count)[:count]
    body = request[:2] + bytes([2 * count]) + b"".join(w.to_bytes(2, "big") for w in words)
    return body + crc(body)


@contextmanager
def device(behave: Behaviour) -> Iterator[str]:
    """A slave on a pseudo-terminal; yields the port's path."""
    master, slave = os.openpty()
    stopping = threading.Event()

    def serve() -> None:
        number = 0
        while not stopping.is_set():
            if not select.select([master], [], [], 0.02)[0]:
                continue
            request = os.read(master, 256)
            if len(request) == 8 and request[-2:] == crc(request[:-2]):
                delay, reply = behave(number, answer(request))
                number += 1
                time.sleep(delay)
                os.write(master, reply)

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    try:
        yield os.ttyname(slave)
    finally:
        stopping.set()
        thread.join()
        os.close(master)
        os.close(slave)


def poll(
    behave: Behaviour, until: Callable[[Instrument], bool], timeout: float = 0.2
) -> tuple[Instrument, set[float]]:
    """Poll until a condition holds; returns the instrument and all its published counts."""
    seen: set[float] = set()
    cell = read_device(catalog.find("devices", "laumas-tlb"))
    instrument = Instrument("cell", cell, 1, CLOCK, rate=100.0, timeout=timeout)
    instrument.listeners.append(lambda reading: seen.add(reading.raw))
    with device(behave) as port:
        spec = BusSpec("modbus-rtu", port=port, timeout=timeout)
        slow = SlowDevices([ModbusLine("cells", spec, (instrument,), CLOCK)])
        try:
            deadline = time.monotonic() + 8
            while not until(instrument):
                assert time.monotonic() < deadline, f"{instrument.counters} {instrument.problem}"
                time.sleep(0.01)
        finally:
            slow.close()
    return instrument, seen


def test_readings_come() -> None:
    instrument, seen = poll(
        lambda _n, reply: (0.0, reply), lambda i: i.counters.readings > 20, timeout=2.0
    )
    assert seen == {12345}
    assert instrument.latest.value == pytest.approx(123.45)
    assert instrument.counters.timeouts == 0


def corrupt(number: int, reply: bytes) -> tuple[float, bytes]:
    """Every third reply has one wrong bit, every third a byte of noise before it."""
    if number % 3 == 0:
        return 0.0, reply[:8] + bytes([reply[8] ^ 1]) + reply[9:]
    return 0.0, (b"\x55" if number % 3 == 1 else b"") + reply


def late(number: int, reply: bytes) -> tuple[float, bytes]:
    """Every second reply comes after its timeout, with a weight of its own."""
    if number % 2:
        return 0.0, reply
    body = reply[:5] + (99).to_bytes(4, "big") * 2 + reply[13:-2]
    return 0.08, body + crc(body)


def test_a_late_frame_never_becomes_a_number() -> None:
    instrument, seen = poll(
        late, lambda i: i.counters.readings >= 3 and i.counters.late >= 3, timeout=0.06
    )
    assert seen == {12345}
    assert instrument.counters.timeouts >= 3


def test_wrong_check_sums_are_counted_and_a_byte_of_noise_costs_nothing() -> None:
    instrument, seen = poll(corrupt, lambda i: i.counters.readings >= 6 and i.counters.crc >= 3)
    assert seen == {12345}
    assert instrument.counters.resynchronised >= 2
    assert instrument.counters.timeouts == 0
