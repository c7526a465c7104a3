"""What becomes of a device's value: calibration, tare, duplicates, frozen counts, counters."""

from __future__ import annotations

import math
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.drivers.counters import Tally
from winchkit.drivers.publisher import FrozenDetector, HostScale, Publisher, Sampled
from winchkit.drivers.reading import InstrumentReading, Quality

GOOD = Quality.GOOD
NEAR = st.floats(-1000, 1000)


def at(time: float) -> Sampled:
    return Sampled(time, time + 0.002, time - 0.01, time)


@given(NEAR, st.floats(-5, 5), st.floats(0.5, 2), st.floats(0, 1e-4))
def test_the_indicated_value_is_the_inverse_of_the_calibrated(
    x: float, c0: float, c1: float, c2: float
) -> None:
    scale = HostScale((c0, c1, c2))
    assert scale.calibrated(x) == pytest.approx(c0 + c1 * x + c2 * x * x)
    assert scale.indicated(scale.calibrated(x)) == pytest.approx(x, abs=1e-6)


def test_the_tare_of_the_host_is_after_the_calibration() -> None:
    net, gross = HostScale((1.0, 2.0), tare=50.0).apply(100.0, 100.0)
    assert (net, gross) == (151.0, 201.0)


def test_the_tare_of_the_device_is_calibrated_as_it_was_gross() -> None:
    """A parabola: 100 N indicated when tared, 150 N now; not the parabola of 50."""
    scale = HostScale((0.0, 1.0, 1e-3))
    net, gross = scale.apply(50.0, 150.0)
    assert gross == pytest.approx(150 + 22.5)
    assert net == pytest.approx(172.5 - 110.0)


def test_a_flagged_value_is_no_number_whatever_the_device_says() -> None:
    publisher = Publisher(100.0)
    for flag in (Quality.OVERLOAD, Quality.FAULT, Quality.STALE, Quality.MISMATCH):
        reading = publisher.publish(12.0, 12.0, 1200.0, flag, at(0.0))
        assert math.isnan(reading.value)
        assert math.isnan(reading.gross)
        assert reading.raw == 1200.0
    assert math.isnan(publisher.publish(math.nan, 0.0, 0.0, GOOD, at(1.0)).value)
    assert Quality.FAULT in publisher.latest.quality


def test_listeners_get_every_reading_and_repeats_are_counted() -> None:
    publisher, heard = Publisher(100.0), list[InstrumentReading]()
    publisher.listeners.append(heard.append)
    for k, counts in enumerate((1.0, 1.0, 2.0, 2.0, 2.0)):
        publisher.publish(counts, counts, counts, GOOD, at(k * 0.01))
    assert [Quality.DUPLICATE in item.quality for item in heard] == [
        False, True, False, True, True,
    ]  # fmt: skip
    counters = publisher.tally.counters(0.05)
    assert (counters.readings, counters.duplicates) == (5, 3)
    assert counters.rate == pytest.approx(100.0)


def test_the_moment_of_sampling_lies_between_its_limits() -> None:
    reading = Publisher(100.0).publish(1.0, 1.0, 1.0, GOOD, Sampled(1.0, 1.1, 0.9, 1.05))
    assert reading.t_sample == pytest.approx(0.975)
    assert reading.t_uncertainty == pytest.approx(0.075)


def watch(counts: list[float], moving: bool = False) -> list[bool]:
    detector = FrozenDetector()
    return [detector.frozen(item, 1.0, moving) for item in counts]


@pytest.mark.parametrize("moving", [False, True])
def test_a_noisy_cell_that_stops_is_frozen(moving: bool) -> None:
    random = Random(1)
    noisy = [float(round(random.gauss(1000, 3))) for _ in range(1000)]
    told = watch(noisy + [noisy[-1]] * 100, moving)
    assert not any(told[:1000])
    assert told[-1]
    assert 30 <= told[1000:].index(True) <= 45


def test_a_quiet_cell_may_stand_still_for_ever() -> None:
    assert not any(watch([1000.0] * 5000))


def test_a_cell_whose_noise_flips_the_last_digit_only_may_stand_still() -> None:
    """On the edge of a step it flips, in the middle it does not."""
    random = Random(2)
    edge = [float(random.choice((1000, 1001))) for _ in range(2000)]
    assert not any(watch(edge + [1001.0] * 1000))


@pytest.mark.parametrize("division", [0.01, 1.0, 10.0])
def test_noise_is_judged_by_the_division_of_the_counts(division: float) -> None:
    """Noise below the division may cease in the middle of a step; noise above it may not."""
    random = Random(5)
    edge = [division * random.choice((100, 101)) for _ in range(2000)]
    assert not any(watch(edge + [101 * division] * 1000))
    noisy = [division * round(random.gauss(1000, 3)) for _ in range(1000)]
    told = watch(noisy + [noisy[-1]] * 100)
    assert not any(told[:1000])
    assert told[-1]


def test_a_cell_that_was_quiet_before_is_not_frozen_when_quiet_again() -> None:
    random = Random(3)
    noisy = [float(round(random.gauss(1000, 3))) for _ in range(1000)]
    told = watch(noisy + [1000.0] * 100 + noisy + [1000.0] * 100)
    assert any(told[1000:1100])
    assert not any(told[1110:])


def test_a_coarse_cell_may_stand_still_under_a_constant_load_while_the_winch_moves() -> None:
    """Whether it should have changed is a question to the predicted tension (cell frozen)."""
    before = [1000.0 + k for k in range(150)]
    assert not any(watch(before + [before[-1]] * 5000, moving=True))
    assert not any(watch([1000.0] * 5000, moving=True))


def test_polling_faster_than_it_converts_is_not_frozen() -> None:
    random, detector = Random(4), FrozenDetector()
    value, told = 0.0, []
    for k in range(20_000):
        if k % 50 == 0:
            value = float(round(random.gauss(1000, 3)))
        told.append(detector.frozen(value, 1 / 50, False))
    assert not any(told)


def test_latencies_are_reported_within_a_bin() -> None:
    tally = Tally()
    for k in range(1000):
        tally.reading(k * 0.01, 0.002 if k % 100 else 0.05)
    latency = tally.counters(10.0).latency
    assert 0.002 <= latency.p50 <= 0.002 * 1.26
    assert 0.002 <= latency.p99 <= 0.002 * 1.26
    assert latency.worst == 0.05


def test_a_rate_becomes_zero_when_readings_cease() -> None:
    tally = Tally()
    assert math.isnan(tally.counters(0.0).rate)
    for k in range(100):
        tally.reading(k * 0.1)
    assert tally.counters(9.9).rate == pytest.approx(10.0)
    assert tally.counters(12.0).rate == 0.0


@given(st.lists(st.floats(0, 200), min_size=1, max_size=500))
def test_percentiles_are_in_order_and_never_above_the_worst(latencies: list[float]) -> None:
    tally = Tally()
    for k, latency in enumerate(latencies):
        tally.reading(float(k), latency)
    seen = tally.counters(0.0).latency
    assert seen.p50 <= seen.p99 <= seen.worst == max(latencies)
