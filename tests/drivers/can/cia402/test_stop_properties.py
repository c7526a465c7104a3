"""Stops against an independent drive: every state, 605Ah and requested state, late status words.

The drive here is a table of the standard's command patterns and of what quick stop leads to. The
host sees its status words some cycles late, as on a bus, and one of them may be lost.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from hypothesis import given, settings
from hypothesis import strategies as st

from cia402_table import STOPS, transition
from winchkit.drivers.can.cia402.state_machine import (
    TRANSITIONS,
    DriveState,
    RequestedState,
    control_word,
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
