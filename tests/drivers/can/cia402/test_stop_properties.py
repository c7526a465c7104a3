"""Control words for every state, by the standard's bit patterns, and stops of an own drive.

The drive here is a table of the standard's command patterns and of what quick stop leads to. The
host sees its status words some cycles late, as on a bus, and one of them may be lost.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, cast

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from cia402_table import STOPS, transition
from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.cia402.sdo_stop import SdoStop
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

ENERGISING = {2, 3, 4, 16}
RAMP_CYCLES = 3
OPTION_CODES = (*range(-2, 9),)
AFTER = {row.number: row.target for row in TRANSITIONS}


@dataclass
class Drive:
    """Takes control words; its motor turns while it is enabled and until a ramp is over."""

    state: DriveState
    option: int
    """605Ah; negative ones coast, as a maker's own may."""
    previous: int
    moving: bool = True
    taken: list[int] = field(default_factory=list)
    _left: int = RAMP_CYCLES

    def take(self, word: int) -> None:
        """One cycle with a control word."""
        number = transition(self.state, self.previous, word)
        self.previous = word
        if number == 16 and self.option < 5:
            number = None
        if number is not None:
            self.taken.append(number)
            if number == 3 and word & 0x0F == 0x0F:
                self.taken.append(4)
            self.state = AFTER[4 if 4 in self.taken[-1:] else number]
            if self.state is DriveState.QUICK_STOP_ACTIVE:
                self._left = RAMP_CYCLES
        self._advance()

    def _advance(self) -> None:
        if self.state is DriveState.FAULT_REACTION_ACTIVE:
            self.state = DriveState.FAULT
        elif self.state is DriveState.QUICK_STOP_ACTIVE:
            self._left -= 1
            if self.option <= 0 or self._left <= 0:
                self.moving = False
                if self.option < 5:
                    self.state = DriveState.SWITCH_ON_DISABLED
        elif self.state is not DriveState.OPERATION_ENABLED:
            self.moving = False


@given(
    start=st.sampled_from([s for s in DriveState if s is not DriveState.UNKNOWN]),
    option=st.sampled_from(OPTION_CODES),
    requested=st.sampled_from(STOPS),
    previous=st.sampled_from([0x00, 0x02, 0x06, 0x07, 0x0F, 0x80, 0x10F]),
    delay=st.integers(0, 3),
    lost=st.sets(st.integers(0, 30), max_size=12),
)
@settings(max_examples=400, deadline=None)
def test_no_stop_takes_an_energising_transition_with_any_605a(
    start: DriveState,
    option: int,
    requested: RequestedState,
    previous: int,
    delay: int,
    lost: set[int],
) -> None:
    drive = Drive(start, option, previous)
    seen: deque[tuple[int, DriveState, bool]] = deque([(0, start, drive.moving)])
    word = previous
    for cycle in range(30):
        known, state, moving = seen[0]
        age = cycle - known
        word = control_word(state, requested, previous=word, age=age, at_rest=not moving)
        if word & 0x0F == 0x0F:
            assert requested in (RequestedState.RUN_DOWN, RequestedState.HALT)
            assert age <= 5
            assert state is DriveState.OPERATION_ENABLED
        drive.take(word)
        if cycle not in lost:
            seen.append((cycle + 1, drive.state, drive.moving))
        while len(seen) > 1 and seen[1][0] <= cycle + 1 - delay:
            seen.popleft()
    assert not ENERGISING & set(drive.taken)
    if requested is RequestedState.DISABLE and delay <= 1 and not lost:
        # Nothing may hang half-way: a stop ends off, or in the fault that it began in.
        faults = (DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE)
        ended = DriveState.FAULT if start in faults else DriveState.SWITCH_ON_DISABLED
        assert drive.state is (start if start is DriveState.NOT_READY_TO_SWITCH_ON else ended)


@given(option=st.sampled_from(OPTION_CODES), delay=st.integers(0, 1))
def test_a_reset_leads_a_faulty_drive_to_switch_on_disabled_and_no_further(
    option: int, delay: int
) -> None:
    drive = Drive(DriveState.FAULT, option, 0x0F, moving=False)
    seen = deque([DriveState.FAULT] * (delay + 1))
    word = 0x0F
    for _ in range(10):
        word = control_word(seen.popleft(), RequestedState.RESET, previous=word, at_rest=True)
        drive.take(word)
        seen.append(drive.state)
    assert drive.taken == [15]
    assert drive.state is DriveState.SWITCH_ON_DISABLED


@given(option=st.sampled_from([5, 6, 7, 8]), delay=st.integers(0, 2))
def test_a_quick_stop_that_stays_is_left_downwards_only(option: int, delay: int) -> None:
    """With 605Ah of 5 to 8 the word 0Fh would enable it again (transition 16)."""
    drive = Drive(DriveState.OPERATION_ENABLED, option, 0x0F)
    seen = deque([(DriveState.OPERATION_ENABLED, True)] * (delay + 1))
    word = 0x0F
    for _ in range(20):
        state, moving = seen.popleft()
        word = control_word(state, RequestedState.DISABLE, previous=word, at_rest=not moving)
        drive.take(word)
        seen.append((drive.state, drive.moving))
    assert drive.taken == [11, 12]
    assert drive.state is DriveState.SWITCH_ON_DISABLED


_ABORT = bytes.fromhex("8040600022000008")
_WROTE = bytes.fromhex("6040600000000000")


class Bus:
    """Takes frames, and gives replies to whoever listens."""

    def __init__(self) -> None:
        self.sent: list[tuple[int, bytes]] = []
        self.handlers: dict[int, Callable[[bytes, float], None]] = {}

    def on(self, identifier: int, handler: Callable[[bytes, float], None]) -> None:
        self.handlers[identifier] = handler

    def off(self, identifier: int) -> None:
        del self.handlers[identifier]

    def send(self, identifier: int, data: bytes) -> None:
        self.sent.append((identifier, data))

    def pass_on(self, *_: Any) -> None:
        raise AssertionError("it is a reply to the stop")


def test_a_refusal_is_forgotten_with_the_stop_that_was_refused() -> None:
    """The next stop begins before its first SDO frame, and must not count as refused."""
    bus = Bus()
    stop = SdoStop(cast("CanBus", bus), 5)
    stop.send()
    bus.handlers[0x585](_ABORT, 0.0)
    assert stop.refused
    stop.end()
    assert not stop.refused
    stop.send()
    bus.handlers[0x585](_WROTE, 0.0)
    assert (stop.taken, stop.refused) == (True, False)


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
