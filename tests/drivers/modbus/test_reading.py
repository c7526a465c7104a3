"""Registers to readings: the manual's layout, word orders, signs, and never a wrong number."""

import dataclasses
import math
import struct
from functools import cache

import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit import catalog
from winchkit.drivers.modbus.decoder import RegisterDecoder
from winchkit.drivers.reading import Quality
from winchkit.errors import FileError
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.devices.modbus import FieldSpec, ModbusSpec, ReadBlock
from winchkit.schema.read import read_device


def device(field: FieldSpec, count: int = 3, status: int | None = 0) -> DeviceSpec:
    block = ReadBlock(0, count)
    modbus = ModbusSpec(block, (field,), field.name, status_register=status)
    return DeviceSpec("x", "m", "x", "test", "generic", modbus=modbus)


@cache
def laumas() -> RegisterDecoder:
    return RegisterDecoder(read_device(catalog.find("devices", "laumas-tlb")))


def registers(status: int, gross: int, net: int) -> list[int]:
    """As the manual lays them out: status, then gross, net and peak, high word first."""
    words = [status]
    for value in (gross, net, 0):
        words += [value >> 16, value & 0xFFFF]
    return words


@given(net=st.integers(0, 999_999), negative=st.booleans())
def test_laumas_net_weight(net: int, negative: bool) -> None:
    status = 1 << 11 | (1 << 8 if negative else 0)
    value, gross, counts, quality, _ = laumas().decode(registers(status, 5, net))
    assert counts == (-net if negative else net)
    assert value == pytest.approx(counts * 0.01)
    assert gross == pytest.approx(0.05)
    assert quality is Quality.GOOD


@pytest.mark.parametrize(
    ("bit", "flag"),
    [
        (0, Quality.FAULT),
        (1, Quality.FAULT),
        (2, Quality.OVERLOAD),
        (3, Quality.OVERLOAD),
        (4, Quality.OVERLOAD),
        (5, Quality.OVERLOAD),
    ],
)
def test_laumas_alarms_give_no_number(bit: int, flag: Quality) -> None:
    value, _, _, quality, _ = laumas().decode(registers(1 << bit | 1 << 11, 1000, 1000))
    assert math.isnan(value)
    assert quality is flag
    assert not quality.usable


def test_unstable_is_still_a_number() -> None:
    value, _, _, quality, status = laumas().decode(registers(1 << 10, 0, 12345))
    assert value == pytest.approx(123.45)
    assert quality is Quality.UNSTABLE
    assert laumas().status.has("net", status)
    assert "unstable" in str(quality)


_PACK = {"u16": ">H", "i16": ">h", "u32": ">I", "i32": ">i", "f32": ">f"}
_RANGE = {
    "u16": st.integers(0, 0xFFFF),
    "i16": st.integers(-0x8000, 0x7FFF),
    "u32": st.integers(0, 0xFFFFFFFF),
    "i32": st.integers(-(2**31), 2**31 - 1),
    "f32": st.floats(width=32, allow_nan=False, allow_infinity=False).filter(
        lambda number: number == 0 or abs(number) > 1e-30
    ),
}


@given(
    data=st.data(),
    kind=st.sampled_from(sorted(_PACK)),
    order=st.sampled_from(["ABCD", "CDAB", "BADC", "DCBA"]),
)
def test_every_type_in_every_order(data: st.DataObject, kind: str, order: str) -> None:
    """The wire is built here by permuting bytes, and the reader must get the number back."""
    number = data.draw(_RANGE[kind])
    big = struct.pack(_PACK[kind], number)
    if len(big) == 2:
        wire = big if order in ("ABCD", "CDAB") else big[::-1]
    else:
        wire = bytes(big["ABCD".index(letter)] for letter in order)
    words = [0, *struct.unpack(f">{len(wire) // 2}H", wire), 0][:3]
    field = FieldSpec("v", 1, kind, order, unit="N", scale=0.5)  # type: ignore[arg-type]
    value, _, counts, _, _ = RegisterDecoder(device(field)).decode(words)
    assert counts == number
    assert value == pytest.approx(number * 0.5)


@pytest.mark.parametrize("bits", [0x7FC00000, 0x7F800000, 0xFF800000])
def test_a_float_that_is_no_number_is_a_fault(bits: int) -> None:
    field = FieldSpec("v", 1, "f32", unit="N")
    value, _, _, quality, _ = RegisterDecoder(device(field)).decode([0, bits >> 16, bits & 0xFFFF])
    assert math.isnan(value)
    assert quality is Quality.FAULT


def test_units_become_si() -> None:
    field = FieldSpec("v", 1, "i32", unit="mm", scale=0.1)
    assert RegisterDecoder(device(field)).decode([0, 0, 12345])[0] == pytest.approx(1.2345)


@pytest.mark.parametrize(
    ("field", "status", "words"),
    [
        (FieldSpec("v", 2, "u32", unit="N"), 0, "not within the block 0 to 2"),
        (FieldSpec("v", 1, "u32", unit="N"), 7, "is in no block"),
        (FieldSpec("v", 1, "u32", unit="newton"), 0, "unknown unit"),
    ],
)
def test_device_files_that_contradict_themselves(field: FieldSpec, status: int, words: str) -> None:
    with pytest.raises(FileError, match=words):
        RegisterDecoder(device(field, status=status))


def test_a_value_must_be_a_field_and_a_servo_is_no_instrument() -> None:
    good = device(FieldSpec("v", 1, "u32", unit="N"))
    assert good.modbus is not None
    bad = dataclasses.replace(good, modbus=dataclasses.replace(good.modbus, value="w"))
    with pytest.raises(FileError, match="'w' is none of the fields v"):
        RegisterDecoder(bad)
    with pytest.raises(FileError, match="no Modbus instrument"):
        RegisterDecoder(dataclasses.replace(good, modbus=None))
