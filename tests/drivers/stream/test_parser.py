"""The parser on its own: any cutting into chunks, garbage, half frames, arbitrary bytes."""

from __future__ import annotations

import math
import re
from dataclasses import asdict
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stream_rig import DEVICES, device, stream
from winchkit.drivers.stream.decoder import FrameType, Matcher, fits
from winchkit.drivers.stream.parser import BinaryFraming, StreamFrame, StreamParser, TextFraming
from winchkit.schema.template import parts_of
from winchkit.sim.instruments.stream_frames import IndicatorState, Speech

PARSED = {name: device(name) for name in DEVICES}
TEXT = tuple(name for name in DEVICES if name != "hbm-aed-binary")
GUARDED = ("laumas-tlb-ascii",)
"""Devices whose frames have a check sum."""
FIXED = ("hbm-aed-ascii", "flintec-ldu", "and-ad-4406", "mettler-mt-sics", "sartorius-sbi")
"""Devices whose digits stand at fixed places."""


def state(number: float) -> IndicatorState:
    return IndicatorState(number, number, 0.0, tared=False, overload=False, broken=False, address=1)


def said(name: str, number: float) -> bytes:
    """A frame as the simulated device writes it, by code of its own."""
    return Speech(stream(name)).frame(state(number))


def parser(name: str, *, begun: bool = False) -> StreamParser:
    found = StreamParser(PARSED[name])
    if begun:
        found.begin()
    return found


def in_chunks(found: StreamParser, data: bytes, cuts: list[int]) -> list[StreamFrame]:
    edges = [0, *sorted(cut % (len(data) + 1) for cut in cuts), len(data)]
    return [item for start, end in pairwise(edges) for item in found.feed(data[start:end])]


NOISE = st.binary(max_size=40)
CUTS = st.lists(st.integers(0, 10_000), max_size=12)
NUMBERS = st.integers(-99, 99)
"""Small enough for the digits of every device."""


@st.composite
def traffic(draw: st.DrawFn, name: str) -> bytes:
    """Frames of a device with noise between them, some bytes lost, changed or put in."""
    data = bytearray()
    for _ in range(draw(st.integers(1, 6))):
        data += draw(st.one_of(st.just(b""), NOISE)) + said(name, draw(NUMBERS))
    for _ in range(draw(st.integers(0, 4))):
        at = draw(st.integers(0, len(data) - 1))
        how = draw(st.sampled_from(["lose", "change", "put in"]))
        if how == "lose" and len(data) > 1:
            del data[at]
        elif how == "change":
            data[at] = draw(st.integers(0, 255))
        else:
            data.insert(at, draw(st.integers(0, 255)))
    return bytes(data)


@pytest.mark.slow
@pytest.mark.parametrize("name", DEVICES)
@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_any_cutting_into_chunks_says_the_same(name: str, data: st.DataObject) -> None:
    sent = data.draw(st.one_of(traffic(name), st.binary(max_size=300)))
    cuts = data.draw(CUTS)
    begun = data.draw(st.booleans())
    whole, parts = parser(name, begun=begun), parser(name, begun=begun)
    first = [item.frame for item in whole.feed(sent)]
    second = [item.frame for item in in_chunks(parts, sent, cuts)]
    assert repr(first) == repr(second)
    assert asdict(whole.counts) == asdict(parts.counts)


@pytest.mark.slow
@pytest.mark.parametrize("name", DEVICES)
@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_whatever_comes_every_byte_is_accounted_for(name: str, data: st.DataObject) -> None:
    sent = data.draw(st.one_of(traffic(name), st.binary(max_size=400)))
    found = parser(name, begun=data.draw(st.booleans()))
    items = in_chunks(found, sent, data.draw(CUTS))
    counts = found.counts
    assert counts.framed + counts.spoilt + counts.resynchronised + found.pending == len(sent)
    assert sum(item.size for item in items) == counts.framed
    assert found.pending <= max(stream(name).longest, 8) + len(stream(name).terminator)
    for item in items:
        decoded = item.frame.decoded
        if decoded is not None and decoded.quality.usable:
            value = decoded.value
            assert math.isfinite(value) or item.frame.meaning is FrameType.STATUS
        elif decoded is not None:
            assert math.isnan(decoded.value)


@pytest.mark.parametrize("name", DEVICES)
@settings(deadline=None)
@given(number=NUMBERS)
def test_what_the_simulator_writes_is_what_is_read(name: str, number: int) -> None:
    (item,) = parser(name, begun=True).feed(said(name, number))
    if item.frame.decoded.quality.usable:
        assert item.frame.decoded.counts == number
    else:
        assert abs(number) > (stream(name).capacity or math.inf)


@pytest.mark.slow
@pytest.mark.parametrize("name", TEXT)
@settings(deadline=None)
@given(first=st.binary(max_size=60), numbers=st.lists(NUMBERS, min_size=2, max_size=4))
def test_after_garbage_it_is_in_step_again_by_the_second_frame(
    name: str, first: bytes, numbers: list[int]
) -> None:
    """Whatever came before, at most the frame that the garbage runs into is lost."""
    found = parser(name)
    items = found.feed(first + b"".join(said(name, number) for number in numbers))
    values = [one.frame.decoded.counts for one in items if one.frame.decoded is not None]
    expected = [float(number) for number in numbers[1:]]
    assert values[len(values) - len(expected) :] == expected


@pytest.mark.slow
@pytest.mark.parametrize("name", [*GUARDED, *FIXED])
@settings(deadline=None)
@given(number=NUMBERS, at=st.integers(0, 100), byte=st.integers(0, 255), data=st.data())
def test_a_lost_byte_or_one_put_in_is_no_other_number(
    name: str, number: int, at: int, byte: int, data: st.DataObject
) -> None:
    frame = said(name, number)
    at %= len(frame)
    put_in = frame[:at] + bytes([byte]) + frame[at:]
    spoilt = data.draw(st.sampled_from([frame[:at] + frame[at + 1 :], put_in]))
    for item in parser(name, begun=True).feed(spoilt):
        if item.frame.decoded is not None and item.frame.decoded.quality.usable:
            assert item.frame.decoded.counts == number


@settings(deadline=None)
@given(number=NUMBERS, at=st.integers(0, 100), byte=st.integers(0, 255))
def test_a_changed_byte_of_a_guarded_frame_is_no_other_number(
    number: int, at: int, byte: int
) -> None:
    frame = bytearray(said("laumas-tlb-ascii", number))
    frame[at % len(frame)] = byte
    for item in parser("laumas-tlb-ascii", begun=True).feed(bytes(frame)):
        if item.frame.decoded is not None and item.frame.decoded.quality.usable:
            assert item.frame.decoded.counts == number


def test_half_a_line_at_the_start_is_never_a_number() -> None:
    """The end of +00123.45 is 23.45, a number too; it is dropped, the next one is read."""
    found = parser("generic-line")
    items = found.feed(b"23.45\n+00123.45\n")
    assert [item.frame.text for item in items] == ["+00123.45"]
    assert found.counts.resynchronised == 6


def test_garbage_before_a_frame_that_begins_with_a_mark_does_not_spoil_it() -> None:
    found = parser("laumas-tlb-ascii", begun=True)
    (item,) = found.feed(b"\xff\x00&T01&T012345P012345\\04\r")
    assert item.frame.decoded.value == 123.45
    assert found.counts.resynchronised == 6
    assert item.size == 19


def test_two_frames_that_ran_into_each_other_are_not_one_number() -> None:
    found = parser("generic-line", begun=True)
    assert found.feed(b"12.3412.35\n") == []
    assert found.counts.malformed == 1


def test_a_line_without_end_takes_no_memory_and_is_counted() -> None:
    found = parser("generic-line", begun=True)
    for _ in range(100):
        assert found.feed(b"9" * 1000) == []
    assert found.pending <= 32
    assert found.feed(b"\n1.5\n")[0].frame.text == "1.5"
    assert found.counts.resynchronised == 100_001


def test_how_far_behind_the_end_of_a_chunk_a_frame_was() -> None:
    items = parser("generic-line", begun=True).feed(b"1.0\n2.0\n3.")
    assert [item.behind for item in items] == [6, 2]


def test_a_binary_frame_is_counted_never_searched() -> None:
    found = parser("hbm-aed-binary", begun=True)
    (item,) = found.feed(b"\r\n\r\n\r\n")
    assert item.frame.decoded.counts == 0x0D0A0D
    assert found.feed(b"\x4e\x20\x00\x08\r\n") == [], "a frame that nobody asked for"
    assert found.counts.resynchronised == 6


@settings(deadline=None)
@given(st.lists(st.binary(max_size=20), max_size=20), st.sampled_from(["\n", "\r\n", "ab\r"]))
def test_text_framing_loses_no_byte(chunks: list[bytes], terminator: str) -> None:
    framing = TextFraming(terminator, 16)
    pieces = [piece for chunk in chunks for piece in framing.feed(chunk)]
    total = sum(map(len, chunks))
    assert sum(piece.size for piece in pieces) + framing.resynchronised + framing.pending == total


@settings(deadline=None)
@given(st.binary(max_size=30), st.integers(1, 6))
def test_binary_framing_loses_no_byte(data: bytes, length: int) -> None:
    framing = BinaryFraming(length, "\r\n")
    framing.begin()
    pieces = framing.feed(data)
    assert sum(piece.size for piece in pieces) + framing.resynchronised + framing.pending == len(
        data
    )


STARS = st.text("ab*", max_size=8)


@settings(deadline=None)
@given(st.text("ab", max_size=10), STARS)
def test_stars_stand_for_anything(text: str, pattern: str) -> None:
    """Against Python's regular expressions."""
    wanted = re.fullmatch(".*".join(map(re.escape, pattern.split("*"))), text) is not None
    assert (fits(text, [pattern]) == pattern) is wanted


def test_a_template_takes_linear_time_whatever_comes() -> None:
    """A field without width never holds the character that ends it: nothing to go back to."""
    matcher = Matcher(parts_of("{skip},{skip},{skip},{skip},{skip},{value}x"))
    assert matcher.match("," * 20_000) is None
    assert matcher.match("1," * 20_000) is None
