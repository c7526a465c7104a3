"""Messages between the bench and the instrument process arrive as they were sent."""

from __future__ import annotations

import json
import math
import struct

import pytest

from winchkit.drivers.instrument_process.messages import (
    Kind,
    MessageCutter,
    RawReading,
    json_message,
    message,
    raw_reading_of,
    reading_message,
)
from winchkit.drivers.publisher import Sampled
from winchkit.drivers.reading import Quality

WHEN = Sampled(10.25, 10.5, 10.125, 10.375)


@pytest.mark.parametrize("size", [1, 2, 5, 7, 1000])
def test_messages_are_whole_however_they_arrive(size: int) -> None:
    said = [RawReading(k, 1.5 * k, 2.5 * k, -k, Quality.UNSTABLE, WHEN) for k in range(300)]
    sent = message(Kind.READY) + b"".join(map(reading_message, said))
    sent += json_message(Kind.REPLY, [7, {"serial number": 4711.0}, None])
    messages, found = MessageCutter(), []
    for at in range(0, len(sent), size):
        found += messages.feed(sent[at : at + size])
    assert [kind for kind, _ in found] == [Kind.READY, *[Kind.READING] * 300, Kind.REPLY]
    assert [raw_reading_of(content) for kind, content in found if kind is Kind.READING] == said
    assert json.loads(found[-1][1]) == [7, {"serial number": 4711.0}, None]


def test_a_value_that_is_no_number_stays_none() -> None:
    flags = Quality.OVERLOAD | Quality.LATE
    sent = reading_message(RawReading(65_535, math.nan, math.inf, -math.inf, flags, WHEN))
    ((_, content),) = MessageCutter().feed(sent)
    said = raw_reading_of(content)
    assert said.instrument == 65_535
    assert math.isnan(said.value)
    assert (said.gross, said.counts) == (math.inf, -math.inf)
    assert said.quality == flags
    assert said.when == WHEN


def test_the_form_of_a_reading() -> None:
    """Kind, length, instrument, value, gross, counts, flags, four times; little-endian."""
    sent = reading_message(RawReading(3, 1.0, 2.0, 4.0, Quality.FAULT, WHEN))
    unpacked = struct.unpack("<BIH3dI4d", sent)
    assert unpacked == (2, 62, 3, 1.0, 2.0, 4.0, Quality.FAULT.value, 10.25, 10.5, 10.125, 10.375)
