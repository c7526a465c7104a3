"""The cycles around a trip: two seconds before and half a second after, until the reset."""

from __future__ import annotations

import math

import pytest

from winchkit.bench.control.snapshot import BenchSnapshot, Direction, Phase, Trip, WinchSnapshot
from winchkit.bench.recording.trip_history import AFTER, BEFORE, TripHistory

CYCLE = 0.01
OVER = Trip("tension", "A", "113 N is above the limit 112 N", Direction.WIND_IN, latches=True)


def cycle(number: int, tripped: tuple[Trip, ...] = (), *, moving: bool = True) -> BenchSnapshot:
    """The cycle of this number: the tension is its time, the command twice the speed."""
    time = number * CYCLE
    winch = WinchSnapshot(
        Phase.MOVING if moving else Phase.DISABLED, "", time, 0.0, 0.0, 0.0, 3.0, -0.1, time,
        commander="page 1" if moving else "", commanded_speed=-0.2,
    )  # fmt: skip
    return BenchSnapshot(time, number, {"A": winch}, tripped, tripped)


def test_the_cycles_around_a_trip_are_kept_until_it_is_reset() -> None:
    history = TripHistory(CYCLE)
    for number in range(1000):
        history(cycle(number))
    assert history.to_dict(cycle(999)) is None
    for number in range(1000, 1400):
        history(cycle(number, (OVER,), moving=number < 1007))
    found = history.to_dict(cycle(1400, (OVER,), moving=False))
    assert found["at"] == pytest.approx(10.0)
    assert found["time"][0] == pytest.approx(-BEFORE)
    assert found["time"][-1] == pytest.approx(AFTER)
    assert len(found["time"]) == round((BEFORE + AFTER) / CYCLE) + 1
    own = found["winch"]["A"]
    assert own["tension"] == pytest.approx([10.0 + t for t in found["time"]])
    assert set(own["commanded_speed"]) == {-0.2}
    assert found["events"] == [[0.0, str(OVER)], [pytest.approx(0.07), "winch A disabled"]]
    assert found["blocked"] == [{"message": str(OVER), "forbids": "winding in"}]
    history(cycle(1400, moving=False))
    assert history.to_dict(cycle(1400)) is None


def test_a_second_trip_after_a_reset_has_its_own_two_seconds() -> None:
    history = TripHistory(CYCLE)
    for number in range(100):
        history(cycle(number, (OVER,) if number > 20 else ()))
    for number in range(100, 150):
        history(cycle(number))
    history(cycle(150, (OVER,)))
    found = history.to_dict(cycle(151, (OVER,)))
    assert found["time"][-1] == 0.0
    assert min(found["time"]) >= -BEFORE
    assert found["time"] == sorted(found["time"])


def test_what_is_not_known_is_null() -> None:
    history = TripHistory(CYCLE)
    blank = WinchSnapshot(Phase.DISABLED, "", 0.0, *([math.nan] * 5))
    history(BenchSnapshot(0.0, 0, {"A": blank}, (OVER,)))
    found = history.to_dict(BenchSnapshot(0.0, 0, {"A": blank}, (OVER,)))
    assert found["winch"]["A"]["tension"] == [None]
