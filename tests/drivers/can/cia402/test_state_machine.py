"""The control word for every state and requested state, against the standard's own bit patterns."""

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from cia402_table import STOPS, transition
from winchkit.drivers.can.cia402.state_machine import (
    ENABLE_OPERATION,
    FAULT_RESET,
    QUICK_STOP,
    TRANSITIONS,
    DriveState,
    RequestedState,
    control_word,
    state_of,
)

states = st.sampled_from(list(DriveState))
words = st.integers(0, 0xFFFF)
ages = st.integers(0, 12)
"""Of a status word, SYNCs."""


@given(
    believed=states,
    true=states,
    requested=st.sampled_from(STOPS),
    previous=words,
    age=ages,
    at_rest=st.booleans(),
)
def test_no_stop_ever_energises(
    believed: DriveState,
    true: DriveState,
    requested: RequestedState,
    previous: int,
    age: int,
    at_rest: bool,
) -> None:
    """Not even when the drive is in another state than the host has received."""
    word = control_word(believed, requested, previous=previous, age=age, at_rest=at_rest)
    assert word & 0x0F != 0x07
    if word & 0x0F == 0x0F:
        assert age <= 5
        assert believed is DriveState.OPERATION_ENABLED
        assert requested in (RequestedState.RUN_DOWN, RequestedState.HALT)
        true = believed
    assert transition(true, previous, word) not in (2, 3, 4, 16)


@given(
    believed=states,
    requested=st.sampled_from(STOPS),
    previous=words,
    age=ages,
    at_rest=st.booleans(),
)
def test_a_stale_state_gets_a_quick_stop(
    believed: DriveState, requested: RequestedState, previous: int, age: int, at_rest: bool
) -> None:
    """A ramp goes on for five SYNCs without an answer, everything else for one."""
    assume(age > (5 if requested in (RequestedState.RUN_DOWN, RequestedState.HALT) else 1))
    word = control_word(believed, requested, previous=previous, age=age, at_rest=at_rest)
    assert word == QUICK_STOP


@given(true=states, requested=st.sampled_from(STOPS), previous=words)
def test_no_stop_lets_a_moving_drive_coast(
    true: DriveState, requested: RequestedState, previous: int
) -> None:
    """Transitions 9 and 12 take the torque away; a moving drive never gets them."""
    word = control_word(true, requested, previous=previous, at_rest=False)
    assert transition(true, previous, word) not in (8, 9, 12)


@pytest.mark.parametrize("start", [s for s in DriveState if s not in (DriveState.UNKNOWN,)])
def test_enabling_climbs_one_step_at_a_time_and_never_leaves_a_fault(start: DriveState) -> None:
    after = {row.number: row.target for row in TRANSITIONS}
    state, seen, previous = start, [], 0
    for _ in range(8):
        word = control_word(state, RequestedState.ENABLE, previous=previous, at_rest=True)
        number = transition(state, previous, word)
        if number is not None:
            seen.append(number)
            state = after[number]
        previous = word
    if start in (
        DriveState.FAULT,
        DriveState.FAULT_REACTION_ACTIVE,
        DriveState.NOT_READY_TO_SWITCH_ON,
    ):
        assert (state, seen) == (start, [])
    else:
        assert state is DriveState.OPERATION_ENABLED
        assert seen == [12, 2, 3, 4][4 - len(seen) :]


def test_reset_is_an_edge_and_stays_disabled() -> None:
    first = control_word(DriveState.FAULT, RequestedState.RESET, previous=FAULT_RESET)
    assert not first & FAULT_RESET
    second = control_word(DriveState.FAULT, RequestedState.RESET, previous=first)
    assert second == FAULT_RESET
    for state in DriveState:
        if state is not DriveState.FAULT:
            assert control_word(state, RequestedState.RESET, previous=second) == QUICK_STOP


@pytest.mark.parametrize(
    ("status", "state"),
    [
        (0x0000, DriveState.NOT_READY_TO_SWITCH_ON),
        (0x0250, DriveState.SWITCH_ON_DISABLED),
        (0x0231, DriveState.READY_TO_SWITCH_ON),
        (0x0233, DriveState.SWITCHED_ON),
        (0x1637, DriveState.OPERATION_ENABLED),
        (0x0217, DriveState.QUICK_STOP_ACTIVE),
        (0x021F, DriveState.FAULT_REACTION_ACTIVE),
        (0x0218, DriveState.FAULT),
        (0x0024, DriveState.UNKNOWN),
    ],
)
def test_status_words_of_real_drives(status: int, state: DriveState) -> None:
    assert state_of(status) is state


@given(status=words)
def test_every_status_word_is_one_state_whatever_the_other_bits(status: int) -> None:
    assert state_of(status) is state_of(status & 0x6F)


def test_a_moving_quick_stop_is_not_left_for_enabling() -> None:
    word = control_word(DriveState.QUICK_STOP_ACTIVE, RequestedState.ENABLE, at_rest=False)
    assert word == QUICK_STOP
    assert control_word(DriveState.OPERATION_ENABLED, RequestedState.ENABLE) == ENABLE_OPERATION
