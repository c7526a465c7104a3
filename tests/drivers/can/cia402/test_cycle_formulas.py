"""What is computed of a drive in every cycle agrees with its plain formulas, written again here."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from winchkit.drivers.can.cia402.position_counter import PositionCounter
from winchkit.drivers.can.cia402.standstill import Standstill
from winchkit.drivers.can.cia402.state_machine import DriveState, RequestedState, control_word
from winchkit.drivers.can.cia402.units import CountScale

SCALE = CountScale(angle=1e-3, velocity=0.1, torque=1e-3)
ENABLING = {
    DriveState.SWITCH_ON_DISABLED: 0x06,
    DriveState.READY_TO_SWITCH_ON: 0x07,
    DriveState.SWITCHED_ON: 0x0F,
    DriveState.OPERATION_ENABLED: 0x0F,
}


def word_by_the_rules(
    state: DriveState, requested: RequestedState, previous: int, age: int, at_rest: bool
) -> int:
    """The rules of ``control_word`` in the order of its docstring."""
    if requested is RequestedState.ENABLE and state in ENABLING:
        return ENABLING[state]
    ramp = previous & 0x8F == 0x0F and age <= 5 and state is DriveState.OPERATION_ENABLED
    if ramp and requested in (RequestedState.RUN_DOWN, RequestedState.HALT):
        return 0x0F if requested is RequestedState.RUN_DOWN else 0x10F
    if (
        age <= 1
        and state is DriveState.FAULT
        and requested is RequestedState.RESET
        and not previous & 0x80
    ):
        return 0x80
    at_end = age <= 1 and at_rest and state is DriveState.QUICK_STOP_ACTIVE
    return 0x00 if at_end and requested in (RequestedState.DISABLE, RequestedState.ENABLE) else 0x02


@given(
    state=st.sampled_from(DriveState),
    requested=st.sampled_from(RequestedState),
    previous=st.sampled_from([0x00, 0x02, 0x06, 0x07, 0x0F, 0x10F, 0x80, 0x8F]),
    age=st.integers(0, 7),
    at_rest=st.booleans(),
)
@settings(max_examples=500)
def test_the_control_word_is_that_of_the_rules(
    state: DriveState, requested: RequestedState, previous: int, age: int, at_rest: bool
) -> None:
    found = control_word(state, requested, previous=previous, age=age, at_rest=at_rest)
    assert found == word_by_the_rules(state, requested, previous, age, at_rest)


SPEED, TRAVEL = 0.15, 2e-3
FEEDBACK = st.tuples(
    st.sampled_from([0.0, 0.004, 0.004, 0.02, 0.04]),
    st.sampled_from([math.nan, 0.0, 0.5 * TRAVEL, 2.1 * TRAVEL, -3.0]),
    st.sampled_from([math.nan, 0.0, 0.0, -SPEED, SPEED, 1.01 * SPEED, -5.0, math.inf]),
)


@given(sequence=st.lists(FEEDBACK, max_size=40))
@settings(max_examples=300)
def test_a_motor_stands_still_by_the_plain_rule(sequence: list[tuple[float, float, float]]) -> None:
    """Its speed within the resolution, and for 40 ms no place further than the travel from the
    first of them.
    """
    tested = Standstill(SCALE)
    assert (tested.speed, tested.travel) == pytest.approx((SPEED, TRAVEL))
    time, newest, place, since, still = 0.0, -math.inf, math.nan, -math.inf, False
    for step, angle, velocity in sequence:
        time += step
        if time > newest:
            newest = time
            if math.isnan(place):
                place = angle
            if abs(velocity) > tested.speed or abs(angle - place) > tested.travel:
                place, since = angle, time
            still = abs(velocity) <= tested.speed and time - since >= 0.04
        assert tested.take(time, angle, velocity) is still


@given(start=st.integers(-128, 127), turns=st.lists(st.integers(-127, 127), max_size=50))
def test_the_counter_follows_any_steps_of_less_than_half_its_range(
    start: int, turns: list[int]
) -> None:
    counter, true = PositionCounter(-128, 127), start
    assert counter.take(start, 0.0) == start
    for number, step in enumerate(turns, 1):
        true += step
        shown = (true + 128) % 256 - 128
        assert counter.take(shown, number * 0.004) == true
