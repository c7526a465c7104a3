"""Lengths of requests, by which a Modbus RTU reply is identified."""

from __future__ import annotations

import itertools
import random
from collections import deque

from hypothesis import given
from hypothesis import strategies as st

from winchkit.drivers.modbus.late_replies import LateReplies
from winchkit.drivers.reading import REPLY_HORIZON
from winchkit.schema.devices.modbus import ReadBlock

_BLOCK = ReadBlock(function=3, start=7, count=2)


@given(most=st.integers(min_value=2, max_value=20))
def test_successive_requests_have_different_lengths(most: int) -> None:
    """No two in a row, and no two of three where the device answers three lengths."""
    replies = LateReplies(0.01, max_registers=most)
    asked: list[int] = []
    for number in range(31):
        count = replies.count(_BLOCK, float(number))
        assert 2 <= count <= most
        asked.append(count)
        replies.answered(_BLOCK, count)
    if most > 2:
        assert all(a != b for a, b in itertools.pairwise(asked))
    if most > 3:
        assert all(len(set(asked[k : k + 3])) == 3 for k in range(29))


@given(unanswered=st.lists(st.booleans(), min_size=2, max_size=30))
def test_no_request_has_the_length_of_a_reply_that_may_still_come(unanswered: list[bool]) -> None:
    replies = LateReplies(0.01)
    outstanding: dict[int, float] = {}
    now = 0.0
    for lost in unanswered:
        now += 0.02
        count = replies.count(_BLOCK, now)
        if not count:
            continue
        assert outstanding.get(count, 0.0) <= now
        if lost:
            replies.unanswered(count, now)
            outstanding[count] = now + REPLY_HORIZON * 0.01
        else:
            replies.answered(_BLOCK, count)


class Gateway:
    """Answers a query with the oldest reply that its serial line has brought, if there is one."""

    def __init__(self, chance: random.Random, longest: float) -> None:
        self.chance, self.longest = chance, longest
        self.replies: deque[tuple[float, int, float]] = deque()
        """When the serial line brought it, its registers, when the device made it."""

    def query(self, count: int, now: float) -> tuple[int, float] | None:
        """Registers and moment of the answer; the reply that it then waits for no more is lost."""
        waiting = [one for one in self.replies if one[0] <= now]
        if waiting:
            self.replies.remove(waiting[0])
            return waiting[0][1:]
        fate = self.chance.random()
        if fate < 0.3:
            delay = self.chance.uniform(1.0, 0.9 * REPLY_HORIZON) * self.longest
            self.replies.append((now + delay, count, now))
            return None
        return (count, now) if fate < 0.9 else None


@given(seed=st.integers(0, 10_000), lengths=st.integers(2, 9))
def test_no_reply_that_waited_in_a_gateway_is_taken(seed: int, lengths: int) -> None:
    """A model of our own: a third of the replies late, many outstanding when nothing is asked."""
    longest, timeout, now = 0.05, 0.01, 0.0
    replies = LateReplies(longest, max_registers=_BLOCK.count + lengths - 1, tagged=True)
    chance = random.Random(seed)
    gateway = Gateway(chance, longest)
    taken = 0
    for _ in range(400):
        now = max(now + 2e-3, replies.until + chance.choice((0.0, 0.03)))
        count = replies.count(_BLOCK, now)
        if not count:
            continue
        answer = gateway.query(count, now)
        if answer is None or answer[0] != count:
            now += timeout
            replies.unanswered(count, now)
            continue
        replies.answered(_BLOCK, count)
        if not replies.discards():
            assert answer[1] == now, f"{now - answer[1]:.3f} s old"
            taken += 1
    assert taken > 0
