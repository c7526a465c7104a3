"""Bytes that the manuals print, and registers laid out by hand after them."""

from __future__ import annotations

import math
import struct

import pytest

from served import spec_of
from winchkit import catalog
from winchkit.drivers.modbus.decoder import RegisterDecoder, words_of
from winchkit.drivers.modbus.frames import AnswerGate, crc16
from winchkit.drivers.modbus.tcp_frames import TcpAnswerGate
from winchkit.drivers.reading import Quality
from winchkit.schema.read import read_device


def decoder(name: str) -> RegisterDecoder:
    return RegisterDecoder(read_device(catalog.find("devices", name)))


def words(text: str) -> list[int]:
    data = bytes.fromhex(text)
    return list(struct.unpack(f">{len(data) // 2}H", data))


def test_the_pt113_manuals_zero_command() -> None:
    """Page 40 prints 01,10,00,08,00,01,02,00,01,66,D8."""
    command = spec_of("pt113").command["zero"]
    data = words_of(command.type, command.order, command.value)
    body = struct.pack(">BBHHBH", 1, 16, command.register, 1, 2, *data)
    assert body + crc16(body) == bytes.fromhex("011000080001020001" + "66d8")


def test_the_pt113_manuals_tcp_exchange_passes_the_gate() -> None:
    """Page 40: unit 17 is asked for one register, 33, and answers 119."""
    gate = TcpAnswerGate()
    gate.sent(bytes.fromhex("000100000006110300210001"))
    answer = bytes.fromhex("0001000000051103020077")
    assert gate.received(answer) == answer


def test_the_pt113_manuals_serial_answer_passes_the_gate() -> None:
    """Page 40: 01,03,00,21,00,01,D4,00 is answered 01,03,02,00,EB,F8,0B."""
    gate = AnswerGate()
    gate.sent(bytes.fromhex("010300210001d400"))
    answer = bytes.fromhex("01030200ebf80b")
    assert gate.received(answer) == answer


@pytest.mark.parametrize(
    ("status", "flag", "number"),
    [
        ("0002", Quality.GOOD, -123.4),
        ("0006", Quality.UNSTABLE, -123.4),
        ("0003", Quality.STALE, math.nan),
        ("0000", Quality.FAULT, math.nan),
        ("4000", Quality.FAULT, math.nan),
        ("1002", Quality.MISMATCH, math.nan),
    ],
    ids=["ok", "moving", "busy", "not ok", "error 2", "centre of zero, and it is not"],
)
def test_a_pt113_by_its_status(status: str, flag: Quality, number: float) -> None:
    """Net, status, tare, gross, status once more; whole numbers, two's complement, high first."""
    seen = decoder("pt113").decode(words(f"fffffb2e {status} 00000000 fffffb2e {status}"))
    assert seen.quality is flag
    assert seen.value == pytest.approx(number, nan_ok=True)


def test_a_dsc_float_low_word_first() -> None:
    """123.456 is 42F6 E979; the low word comes first. STAT is a float as well, here 0."""
    seen = decoder("mantracourt-dsc").decode(words("e979 42f6"), words("0000 0000"))
    assert seen.value == pytest.approx(123.456, rel=1e-6)
    assert seen.quality is Quality.GOOD


def test_a_dsc_with_its_load_cell_torn_off() -> None:
    """LCINTEG is bit 11, so STAT is the float 2048: 4500 0000."""
    seen = decoder("mantracourt-dsc").decode(words("e979 42f6"), words("0000 4500"))
    assert seen.quality is Quality.FAULT
    assert math.isnan(seen.value)


def test_a_generic_transmitter_reports_its_decimals() -> None:
    """Two decimals in the lowest bits of its status; weight and net as signed pairs."""
    seen = decoder("generic-rs485").decode(words("00003039 ffffcfc7"), words("0002"))
    assert seen.gross == pytest.approx(123.45)
    assert seen.value == pytest.approx(-123.45)
    assert decoder("generic-rs485").decode(words("00003039 ffffcfc7"), words("0001")).value == (
        pytest.approx(-1234.5)
    )


def test_a_generic_transmitter_that_is_overloaded() -> None:
    seen = decoder("generic-rs485").decode(words("00003039 00003039"), words("0202"))
    assert seen.quality is Quality.OVERLOAD
    assert math.isnan(seen.value)


def test_a_generic_transmitter_is_unlocked_before_it_is_zeroed() -> None:
    command = spec_of("generic-rs485").command["zero"]
    assert [(step.register, step.value) for step in command.unlock] == [(5, 0x5AA5)]
    assert command.permanent
    tare = spec_of("generic-rs485").command["tare"]
    assert words_of(tare.type, tare.order, tare.value) == [0x7FFF, 0xFFFF]
    assert tare.writes_many


def test_every_register_device_says_where_its_numbers_come_from() -> None:
    for name in catalog.names("devices"):
        device = read_device(catalog.find("devices", name))
        if device.modbus is not None or device.process is not None:
            assert len(device.source) > 20, name
