"""Lengths of requests, by which a Modbus RTU reply is identified."""

from __future__ import annotations

import itertools

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
