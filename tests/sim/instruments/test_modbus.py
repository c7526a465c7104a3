"""Registers and behaviour of simulated instruments, against the manuals' layouts."""

from __future__ import annotations

import struct
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.catalog import find
from winchkit.errors import UsageError
from winchkit.schema.devices.modbus import FieldSpec, ModbusSpec, Order, ReadBlock, ValueType
from winchkit.schema.read import read_device
from winchkit.sim.instruments.modbus import ModbusInstrument, counts_of, encode, in_unit_of

ORDERS: tuple[Order, ...] = ("ABCD", "CDAB", "BADC", "DCBA")


def spec(name: str) -> ModbusSpec:
    found = read_device(find("devices", name)).modbus
    assert found is not None
    return found


def wire(registers: list[int]) -> bytes:
    return b"".join(struct.pack(">H", register) for register in registers)


def in_order(order: str, sent: bytes) -> bytes:
    """Put the bytes of the wire back as A B C D."""
    places = order if len(sent) == 4 else {"ABCD": "AB", "CDAB": "AB"}.get(order, "BA")
    by_letter = dict(zip(places, sent, strict=True))
    return bytes(by_letter[letter] for letter in sorted(by_letter))


NUMBERS: dict[ValueType, tuple[str, st.SearchStrategy[float]]] = {
    "i32": (">i", st.integers(-(2**31), 2**31 - 1)),
    "i16": (">h", st.integers(-(2**15), 2**15 - 1)),
    "f32": (">f", st.floats(width=32, allow_nan=False)),
}


@pytest.mark.parametrize("kind", NUMBERS)
@given(data=st.data())
def test_numbers_in_every_order(kind: ValueType, data: st.DataObject) -> None:
    layout, numbers = NUMBERS[kind]
    order, value = data.draw(st.sampled_from(ORDERS)), data.draw(numbers)
    field = FieldSpec("x", 0, kind, order)
    sent = wire(encode(field, counts_of(field, value)[0]))
    assert in_order(order, sent) == struct.pack(layout, value)


@given(st.floats(-1e7, 1e7), st.floats(1e-4, 10.0))
def test_counts_are_the_nearest_of_the_scale(value: float, scale: float) -> None:
    field = FieldSpec("x", 0, "i32", scale=scale)
    counts, clipped = counts_of(field, value)
    if not clipped:
        assert abs(counts * scale - value) <= scale * 0.5000001


@pytest.mark.parametrize(
    ("kind", "value", "counts"),
    [("u16", -1.0, 0), ("u16", 7e4, 65535), ("i16", -4e4, -32768), ("u32", 5e9, 2**32 - 1)],
)
def test_a_value_beyond_the_type_is_clipped_and_reported(
    kind: ValueType, value: float, counts: int
) -> None:
    assert counts_of(FieldSpec("x", 0, kind), value) == (counts, True)


class Source:
    def __init__(self, value: float = 0.0) -> None:
        self.value = value

    def __call__(self) -> float:
        return self.value


def settled(instrument: ModbusInstrument, duration: float = 1.0) -> float:
    end = instrument.next_conversion + duration
    while instrument.next_conversion <= end:
        instrument.convert()
    instrument.show(instrument.next_conversion)
    return end


def laumas(value: float) -> tuple[ModbusInstrument, Source]:
    source = Source(value)
    return ModbusInstrument(spec("laumas-tlb"), source, now=0.0), source


def manual(instrument: ModbusInstrument) -> tuple[int, int, int, int]:
    """Status, gross, net, peak as the TLB's manual lays them out: 40007, 40008, 40010, 40012."""
    registers = instrument.registers()
    words = [registers[40_001 + offset - 40_001] for offset in range(6, 13)]
    data = struct.pack(">7H", *words)
    status, gross, net, peak = struct.unpack(">HIII", data)
    return status, gross, net, peak


def test_laumas_shows_magnitudes_with_signs_in_the_status() -> None:
    instrument, _ = laumas(-123.45)
    settled(instrument)
    status, gross, net, _ = manual(instrument)
    assert (gross, net) == (12_345, 12_345)
    assert status & (1 << 7)
    assert status & (1 << 8)
    assert status & (1 << 11), "stable"
    assert not status & (1 << 12)


def test_laumas_tares_zeroes_and_goes_back_to_gross() -> None:
    instrument, source = laumas(100.0)
    settled(instrument)
    assert instrument.command(5, 7)
    source.value = 80.0
    settled(instrument)
    status, gross, net, peak = manual(instrument)
    assert (gross, net, peak) == (8_000, 2_000, 10_000)
    assert status & (1 << 8)
    assert not status & (1 << 7)
    assert status & (1 << 10)
    assert instrument.command(5, 9)
    assert manual(instrument)[2] == 8_000
    assert instrument.command(5, 8)
    status, gross, _, _ = manual(instrument)
    assert gross == 0
    assert status & (1 << 12)
    assert not instrument.command(5, 1234)
    assert not instrument.command(6, 7)


def test_a_moving_value_is_not_stable() -> None:
    instrument, source = laumas(0.0)
    for step in range(600):
        source.value = 0.5 * step
        instrument.convert()
    instrument.show(instrument.next_conversion)
    assert not manual(instrument)[0] & (1 << 11)


@pytest.mark.parametrize(("kind", "bit"), [("overload", 2), ("sensor break", 0)])
def test_status_bits_of_faults(kind: str, bit: int) -> None:
    instrument, _ = laumas(50.0)
    instrument.inject(kind)
    settled(instrument)
    assert manual(instrument)[0] & (1 << bit)
    instrument.inject("recover")
    settled(instrument)
    assert not manual(instrument)[0] & (1 << bit)


def test_no_number_is_shown_for_what_cannot_be_measured() -> None:
    instrument, source = laumas(50.0)
    source.value = float("nan")
    settled(instrument)
    status, gross, _, _ = manual(instrument)
    assert status & 1
    assert gross == 0


def test_values_change_at_the_conversion_rate_and_after_the_filter() -> None:
    device = replace(spec("laumas-tlb"), rate=100.0, filter_delay=0.025)
    source = Source()
    instrument = ModbusInstrument(device, source, now=0.0)
    seen = []
    for millisecond in range(200):
        now = millisecond * 1e-3
        source.value = float(millisecond)
        while instrument.next_conversion <= now + 1e-9:
            instrument.convert()
        instrument.show(now + 1e-9)
        seen.append(manual(instrument)[1] / 100)
    assert len(set(seen[60:])) == pytest.approx(14, abs=1)
    for millisecond in range(60, 200):
        assert 25 <= millisecond - seen[millisecond] < 35.001


def test_a_frozen_instrument_repeats_itself() -> None:
    instrument, source = laumas(10.0)
    settled(instrument)
    instrument.inject("frozen")
    source.value = 99.0
    settled(instrument)
    assert manual(instrument)[1] == 1_000


def test_an_unknown_fault_names_those_there_are() -> None:
    instrument, _ = laumas(0.0)
    with pytest.raises(UsageError, match=r"silence.*did you mean 'frozen'"):
        instrument.inject("frozn")


def test_length_and_temperature_keep_their_signs_and_units() -> None:
    length = ModbusInstrument(spec("generic-length"), lambda: -1.23456, now=0.0)
    settled(length)
    registers = length.registers()
    assert struct.pack(">2H", registers[1], registers[2]) == struct.pack(">i", -123_456)
    warm = ModbusInstrument(spec("generic-temperature"), lambda: -5.25, now=0.0)
    settled(warm)
    assert warm.registers()[1] == 0x10000 - 525


def test_a_value_is_given_in_the_unit_of_the_device() -> None:
    kilonewton = ModbusSpec(ReadBlock(0, 2), (FieldSpec("force", 0, "i32", unit="kN"),), "force")
    assert in_unit_of(kilonewton, lambda: 2500.0)() == 2.5
    kelvin = ModbusSpec(ReadBlock(0, 2), (FieldSpec("t", 0, "i32", unit="K"),), "t")
    assert in_unit_of(kelvin, lambda: 20.0)() == pytest.approx(293.15)


def test_one_register_past_the_block_can_be_asked_for_unless_the_length_is_fixed() -> None:
    device = spec("generic-length")
    free = ModbusInstrument(device, Source(), now=0.0)
    assert 3 in free.addresses
    fixed = ModbusInstrument(
        replace(device, read=replace(device.read, fixed=True)), Source(), now=0.0
    )
    assert 3 not in fixed.addresses
