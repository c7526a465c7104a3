"""What a line has room for: bytes on the wire by the standard, and a fair share of the rest."""

from __future__ import annotations

from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit import catalog
from winchkit.drivers.modbus.timing import exchange, wire_times
from winchkit.drivers.sharing import LineShare, fair_rates, next_of
from winchkit.schema.bench import BusSpec
from winchkit.schema.devices.modbus import ModbusSpec
from winchkit.schema.read import read_device

REQUESTED_STATES = st.lists(
    st.tuples(st.floats(1, 1000), st.floats(1e-4, 0.1)), min_size=1, max_size=8
)


def spec(name: str) -> ModbusSpec:
    found = read_device(catalog.find("devices", name)).modbus
    assert found is not None
    return found


def test_bytes_and_times_of_an_exchange_by_hand() -> None:
    """TLB: 8 bytes there, 5 + 2 x 7 + 1 register more every other time back; 10 bits a byte."""
    cost = exchange(spec("laumas-tlb"), BusSpec("modbus-rtu", port="x", baudrate=9600))
    assert cost.bytes == 8 + 5 + 14 + 1
    assert cost.wire == pytest.approx(28 * 10 / 9600)
    assert cost.silence == pytest.approx(2 * 3.5 * 10 / 9600)
    there, back = wire_times(spec("laumas-tlb"), BusSpec("modbus-rtu", port="x", baudrate=9600))
    assert there == pytest.approx(8 * 10 / 9600)
    assert back == pytest.approx(19 * 10 / 9600)


def test_parity_and_a_second_stop_bit_are_counted() -> None:
    bus = BusSpec("modbus-rtu", port="x", baudrate=9600, parity="E", stopbits=2)
    assert exchange(spec("laumas-tlb"), bus).wire == pytest.approx(28 * 12 / 9600)


def test_a_device_with_its_status_elsewhere_costs_two_queries() -> None:
    cost = exchange(spec("mantracourt-dsc"), BusSpec("modbus-rtu", port="x", baudrate=115_200))
    assert cost.queries == 2
    assert cost.bytes == 2 * (8 + 5 + 4)


def test_above_19200_baud_the_silence_is_fixed() -> None:
    cost = exchange(spec("laumas-tlb"), BusSpec("modbus-rtu", port="x", baudrate=115_200))
    assert cost.silence == pytest.approx(2 * 1.75e-3)


@given(REQUESTED_STATES)
def test_the_share_is_fair_and_fills_the_line(wishes: list[tuple[float, float]]) -> None:
    wanted, times = [w for w, _ in wishes], [t for _, t in wishes]
    rates = fair_rates(wanted, times)
    load = sum(rate * time for rate, time in zip(rates, times, strict=True))
    assert load <= 0.95 + 1e-9
    short = [rate for rate, wish in zip(rates, wanted, strict=True) if rate < wish - 1e-9]
    assert all(rate <= wish + 1e-9 for rate, wish in zip(rates, wanted, strict=True))
    if short:
        assert load == pytest.approx(0.95)
        assert max(short) == pytest.approx(min(short))
        assert all(rate <= max(short) + 1e-9 for rate in rates)


def test_a_line_is_shared_out_by_what_its_readings_take() -> None:
    """Reckoned with 10 ms each, seen to take 2 ms and 4 ms: 0.95 / 6 ms for each."""
    share = LineShare([300.0, 1000.0], [10e-3, 10e-3])
    assert share.rates == pytest.approx((47.5, 47.5))
    changes = [share.took(k % 2, (2e-3, 4e-3)[k % 2]) for k in range(64)]
    assert sum(changes) == 2
    assert share.rates == pytest.approx((0.95 / 6e-3, 0.95 / 6e-3))
    assert share.time_of(1) == pytest.approx(4e-3)
    assert share.room_for(0) == pytest.approx(0.95 / 6e-3)


def test_a_machine_that_stood_still_does_not_slow_a_line_down() -> None:
    share = LineShare([1000.0], [2e-3])
    for number in range(64):
        share.took(0, 0.3 if number % 16 == 7 else 2e-3)
    assert share.rates == pytest.approx((475.0,))


@dataclass
class Waiting:
    """An instrument that wants to be asked at a rate."""

    rate: float
    due: float = 0.0
    asked: float = 0.0
    answers: int = 0


@given(st.lists(st.floats(1, 400), min_size=1, max_size=6), st.floats(1e-3, 0.02))
def test_turns_on_a_full_line_are_the_fair_share(rates: list[float], time: float) -> None:
    line, now = [Waiting(rate) for rate in rates], 0.0
    while now < 200 * time * len(line):
        turn = next_of(line, now, lambda item: item.due)
        now = max(now, turn.due)
        turn.asked, turn.due = now, max(turn.due + 1 / turn.rate, now)
        turn.answers += 1
        now += time
    fair = fair_rates(rates, [time] * len(line))
    for item, share in zip(line, fair, strict=True):
        assert item.answers / now > 0.93 * share - 2 / now


def test_over_tcp_a_thousand_readings_a_second_are_enough() -> None:
    share = LineShare([4000.0], [1e-4], least=1e-3)
    for _ in range(64):
        share.took(0, 1e-4)
    assert share.rates == pytest.approx((950.0,))
