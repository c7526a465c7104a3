"""Comparison of 6064h with the integral of 606Ch: live measurements agree, others do not."""

from __future__ import annotations

import math

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from counter_agreement import (
    ACCELERATION,
    CYCLE,
    FILTERS,
    RADIUS,
    SPEED,
    agreement_of,
    drives,
    false_ones,
    slowest,
    smallest_jump,
)

DRIVES = drives()


@pytest.mark.parametrize("name", DRIVES)
def test_live_measurements_agree_in_the_units_of_every_shipped_drive(name: str) -> None:
    for number, shown in enumerate(FILTERS.values()):
        assert false_ones(DRIVES[name], shown, 60.0, seed=number) == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["generic-cia402", "maxon-epos4"])
def test_the_smallest_jump_and_the_slowest_motion_are_those_of_the_safety_page(name: str) -> None:
    rpm = name == "maxon-epos4"
    scale = DRIVES[name]
    assert smallest_jump(scale, 0.0) <= (3.15e-3 if rpm else 3.05e-3)
    assert smallest_jump(scale, SPEED) <= (6.25e-3 if rpm else 5.75e-3)
    assert slowest(scale) <= (4.8e-3 if rpm else 0.85e-3)


@settings(max_examples=50, deadline=None)
@given(
    speed=st.floats(0.02, SPEED).flatmap(lambda v: st.sampled_from([v, -v])),
    multiple=st.sampled_from([-1.0, 0.0, 0.5, 0.8, 1.25, 2.0, 10.0]),
    before=st.floats(0.0, 6.0),
)
def test_a_counter_that_counts_another_multiple_is_seen(
    speed: float, multiple: float, before: float
) -> None:
    """Within 4 s, and within 20 mm where it is wrong by a factor of two or more.

    The tolerance of a speed that never changed is 0.15 rad/s for 4 s, and 0.06 rad of a late one.
    """
    assume(4.0 * abs(speed) / RADIUS * (abs(multiple - 1.0) - 0.05) > 0.7)
    compare = agreement_of(DRIVES["generic-cia402"])
    velocity, angle, now = speed / RADIUS, 0.0, 0.0
    while now < before:
        now, angle = now + CYCLE, angle + velocity * CYCLE
        assert not compare.take(now, angle, velocity)
    begun = now
    while not compare.take(now, angle, velocity):
        now, angle = now + CYCLE, angle + multiple * velocity * CYCLE
        assert now < begun + 4.2
    far = multiple in (-1.0, 0.0, 2.0, 10.0)
    assert not far or abs(speed) * (now - begun) < 0.02 + abs(speed) * 0.1


def test_an_unknown_speed_can_be_compared_with_nothing() -> None:
    compare = agreement_of(DRIVES["generic-cia402"])
    assert not any(compare.take(k * CYCLE, float(k), math.nan) for k in range(1000))
    assert not any(compare.take(4 + k * CYCLE, 1000.0, 0.0) for k in range(1000))
    assert compare.take(8.0, 1001.0, 0.0) is False, "a late speed would explain it"
    assert any(compare.take(8.0 + k * CYCLE, 1001.0, 0.0) for k in range(1, 20))


def test_a_homing_and_a_reset_begin_anew() -> None:
    compare = agreement_of(DRIVES["generic-cia402"])
    for k in range(100):
        compare.take(k * CYCLE, 0.0, 0.0)
    compare.suspend()
    assert not any(compare.take(k * CYCLE, 50.0, 0.0) for k in range(100, 200))
    compare.resume()
    assert not any(compare.take(k * CYCLE, 50.0, 0.0) for k in range(200, 300))
    assert any(compare.take(k * CYCLE, 60.0, 0.0) for k in range(300, 400))
    assert str(compare.found).startswith("6064h changed by 1.592 turns of the motor within")
    compare.forget()
    assert not any(compare.take(k * CYCLE, 60.0, 0.0) for k in range(400, 500))


@settings(max_examples=50, deadline=None)
@given(
    span=st.floats(0.02, 0.2),
    begun=st.floats(0.3, 1.0),
    turned=st.just(1.0) | st.floats(-1.0, 0.5),
)
def test_a_gap_in_the_feedback_hides_no_wrong_counter(
    span: float, begun: float, turned: float
) -> None:
    """A jog speeds up from 0.4 s on, and stands again at 1.2 s; nothing is heard for a while."""
    compare = agreement_of(DRIVES["generic-cia402"])
    angle, speed, found = 0.0, 0.0, False
    for k in range(300):
        now = k * CYCLE
        ramp = min(now - 0.4, 1.2 - now) * ACCELERATION
        speed = min(max(ramp, 0.0), SPEED) / RADIUS
        angle += (1.0 if now < 0.4 else turned) * speed * CYCLE
        if not begun < now < begun + span:
            found = compare.take(now, angle, speed)
    assert found == (turned != 1.0)
