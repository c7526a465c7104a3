"""Modbus TCP devices that deviate from the protocol: named, and accepted where that is safe."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from modbus_cell import CLOCK, PATIENT, cell, collected, weigh
from modbus_peer import Peer
from waiting import until
from winchkit.drivers.modbus.deviations import Deviations
from winchkit.drivers.modbus.instrument import Instrument
from winchkit.drivers.modbus.line import ModbusLine
from winchkit.drivers.modbus.tcp_frames import TcpAnswerGate
from winchkit.drivers.slow import SlowDevices
from winchkit.errors import FileError
from winchkit.schema.bench import BusSpec
from winchkit.schema.read import read_bench

_DEVIATING: list[tuple[str, dict[str, Any], str]] = [
    ("other-unit", {"answers_as": 255}, "answers as unit 255 in place of 1"),
    ("other-unit", {"answers_as": 0}, "answers as unit 0 in place of 1"),
    ("transaction-0", {"transaction": lambda _number: 0}, "answers with transaction 0"),
    ("answers-twice", {"copies": 2}, "sends its answers twice"),
    ("answers-twice", {"copies": 2, "apart": 0.02}, "sends its answers twice"),
    ("closes", {"closes": True}, "closes the connection after each answer"),
]


@contextmanager
def served(peer: Peer, instrument: Instrument, *accepted: str) -> Iterator[ModbusLine]:
    deviations: Any = accepted
    spec = BusSpec(
        "modbus-tcp", host="127.0.0.1", port=peer.port, timeout=PATIENT, deviations=deviations
    )
    line = ModbusLine("cells", spec, (instrument,), CLOCK)
    slow = SlowDevices([line])
    try:
        yield line
    finally:
        slow.close()


@pytest.mark.parametrize(("key", "peer", "words"), _DEVIATING)
def test_a_deviation_is_named_with_what_accepts_it(
    key: str, peer: dict[str, Any], words: str
) -> None:
    with Peer(**peer) as device:
        weigh(device, 19_613)
        with served(device, cell(timeout=PATIENT)) as line:
            until(lambda: line.note != "", within=10.0)
            assert words in line.note
            assert f'deviations = ["{key}"] in [bus.cells]' in line.note


@pytest.mark.parametrize(("key", "peer", "words"), _DEVIATING)
def test_an_accepted_deviation_costs_no_reading(key: str, peer: dict[str, Any], words: str) -> None:
    instrument = cell(timeout=PATIENT)
    with Peer(**peer) as device:
        weigh(device, 19_613)
        readings = collected(instrument)
        with served(device, instrument, key) as line:
            until(lambda: len(readings) > 30, within=10.0)
            assert line.note == "", f"{words}: it is accepted"
    assert all(reading.quality.usable for reading in readings)
    assert [reading.value for reading in readings] == pytest.approx([196.13] * len(readings))
    tally = instrument.counters
    assert (tally.drops, tally.malformed, tally.late, tally.reconnects) == (0, 0, 0, 0)


def test_each_request_has_a_connection_of_its_own_where_the_device_closes_them() -> None:
    instrument = cell(timeout=PATIENT)
    with Peer(closes=True) as device:
        weigh(device, 19_613)
        readings = collected(instrument)
        with served(device, instrument, "closes") as line:
            until(lambda: len(readings) > 3, within=10.0)
            assert device.connections >= len(device.requests) - 1
            assert line.note == ""


def test_a_plain_device_that_may_close_is_read_as_well() -> None:
    instrument = cell(timeout=PATIENT)
    with Peer() as device:
        weigh(device, 19_613)
        readings = collected(instrument)
        with served(device, instrument, "closes"):
            until(lambda: len(readings) > 10, within=10.0)


def test_twice_without_a_transaction_is_never_accepted() -> None:
    """A second copy could be taken for the answer to the next request."""
    bus = BusSpec("modbus-tcp", host="x", port=502, deviations=("transaction-0", "answers-twice"))
    assert [key for key, _ in bus.rules()] == ["deviations"]
    instrument = cell()
    with Peer(copies=2, transaction=lambda _number: 0) as device:
        weigh(device, 19_613)
        with served(device, instrument, "transaction-0") as line:
            until(lambda: "this cannot be accepted" in line.note, within=10.0)


def test_a_late_answer_without_a_transaction_is_no_reading() -> None:
    """Every third answer comes after its time-out, when the registers have changed."""
    late = lambda _u, number, body: (0.15 if number % 3 == 2 else 0.0, body)  # noqa: E731
    instrument = cell(timeout=0.1)
    with Peer(behave=late, transaction=lambda _number: 0) as device:
        weigh(device, 19_613)
        readings = collected(instrument)
        with served(device, instrument, "transaction-0"):
            until(lambda: len(readings) > 4, within=10.0)
            weigh(device, 5_000)
            changed = CLOCK.now()
            until(lambda: readings[-1].t_request > changed + 1.0, within=20.0)
    after = [one for one in readings if one.t_request > changed + 0.2 and one.quality.usable]
    assert after
    assert [one.value for one in after] == pytest.approx([50.0] * len(after))


def _frame(transaction: int, unit: int, *pdu: int) -> bytes:
    body = bytes((unit, *pdu))
    return transaction.to_bytes(2) + b"\0\0" + len(body).to_bytes(2) + body


@given(st.lists(st.integers(0, 0xFFFF), min_size=1, max_size=40), st.data())
def test_copies_change_no_answer(values: list[int], data: st.DataObject) -> None:
    """However the stream of answers and copies is cut into segments."""
    gate = TcpAnswerGate(None, Deviations("cells", ("answers-twice",)))
    stream = b""
    for number, value in enumerate(values, start=0x0101):
        gate.sent(_frame(number, 1, 3, 0, 6, 0, 1))
        answer = _frame(number, 1, 3, 2, *value.to_bytes(2))
        stream += answer + answer
        got = b""
        while not got:
            size = data.draw(st.integers(1, len(stream)))
            got, stream = gate.received(stream[:size]), stream[size:]
            if not got and not stream:
                break
        # An answer whose registers hold the head of another frame is refused in any case.
        if gate.lost or gate.broken:
            return
        assert got == answer


def test_a_device_that_does_not_name_its_request_is_alone_on_its_bus(tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"
    winch = (
        '[winch.{name}]\nprofile = "bench-spiral"\nbrake = true\n'
        'servo = {{ device = "generic-cia402", bus = "can", node = {unit} }}\n'
        'cell = {{ device = "laumas-tlb", bus = "cells", unit = {unit} }}\n'
        '[winch.{name}.limits]\nspeed = "0.1 m/s"\n'
    )
    path.write_text(
        'schema = 1\nkind = "bench"\n[bus.can]\nkind = "can"\ninterface = "virtual"\n'
        'channel = "x"\n[bus.cells]\nkind = "modbus-tcp"\nhost = "127.0.0.1"\nport = 502\n'
        'deviations = ["other-unit"]\n'
        + winch.format(name="A", unit=1)
        + winch.format(name="B", unit=2)
    )
    with pytest.raises(FileError, match=r"bench\.toml:11: bus\.cells\.deviations: need a device"):
        read_bench(path)
