"""The simulated cable in simulated time, and how its frames are read."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.catalog import find
from winchkit.errors import UsageError
from winchkit.schema.read import read_device
from winchkit.sim.live.buses import BusWire, Carried
from winchkit.testing.frames import FrameNames

HOST, NODE = 127, 3


class Time:
    """A clock that a test sets."""

    def __init__(self) -> None:
        self.now = 10.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def time() -> Time:
    return Time()


def drained(wire: BusWire, *, from_drive: bool) -> list[int]:
    return [frame[0] for frame in iter(lambda: wire.due(from_drive=from_drive), None)]


def test_an_undisturbed_wire_carries_everything_at_once(time: Time) -> None:
    wire, heard = BusWire(time), []
    wire.taps.append(heard.append)
    assert wire.carry(0x181, b"ab", from_drive=True)
    assert wire.carry(0x201, b"", from_drive=False)
    assert heard == [
        Carried(10.0, 0x181, b"ab", from_drive=True),
        Carried(10.0, 0x201, b"", from_drive=False),
    ]
    assert drained(wire, from_drive=True) == []


def test_what_is_dropped_is_reported_as_lost_and_only_while_it_lasts(time: Time) -> None:
    wire, heard = BusWire(time), []
    wire.taps.append(heard.append)
    end = wire.disturb({0x181})
    assert not wire.carry(0x181, b"", from_drive=True)
    assert wire.carry(0x182, b"", from_drive=True)
    end()
    end()
    assert wire.carry(0x181, b"", from_drive=True)
    assert [frame.lost for frame in heard] == [True, False, False]


def test_what_is_delayed_comes_in_order_of_its_new_time_each_way(time: Time) -> None:
    wire = BusWire(time)
    wire.disturb({1}, delay=0.03)
    wire.disturb({2}, delay=0.01)
    assert not wire.carry(1, b"", from_drive=True)
    assert not wire.carry(2, b"", from_drive=True)
    assert not wire.carry(2, b"", from_drive=False)
    assert drained(wire, from_drive=True) == []
    time.now += 0.0101
    assert drained(wire, from_drive=True) == [2]
    time.now += 0.02
    assert drained(wire, from_drive=True) == [1]
    assert drained(wire, from_drive=False) == [2]


def test_a_share_is_about_that_share_and_the_same_for_a_seed(time: Time) -> None:
    def fates(seed: int) -> list[bool]:
        wire = BusWire(time, seed=seed)
        wire.disturb(range(0x800), share=0.3)
        return [wire.carry(5, b"", from_drive=True) for _ in range(2000)]

    first = fates(1)
    assert first == fates(1) != fates(2)
    # Five standard deviations of a binomial.
    assert abs(first.count(False) - 600) < 5 * (2000 * 0.3 * 0.7) ** 0.5


@pytest.mark.parametrize("options", [{"share": 0.0}, {"share": 1.1}, {"delay": -1.0}])
def test_what_no_wire_does_is_refused(time: Time, options: dict[str, float]) -> None:
    with pytest.raises(UsageError, match="share is above 0"):
        BusWire(time).disturb({1}, **options)  # type: ignore[arg-type]


def names() -> FrameNames:
    known = FrameNames(HOST)
    known.add("A", NODE, read_device(find("devices", "generic-cia402")))
    return known


NAMES = names()


@pytest.mark.parametrize(
    ("identifier", "data", "name", "words"),
    [
        (0x000, "8103", "nmt", "A: reset node"),
        (0x000, "0100", "nmt", "all nodes: start"),
        (0x080, "", "sync", "SYNC"),
        (0x703, "7F", "A.heartbeat", "A: pre-operational"),
        (0x77F, "05", "host.heartbeat", "host: operational"),
        (0x603, "4041600000000000", "A.sdo", "A: read 6041h Statusword"),
        (0x603, "6000000000000000", "A.sdo", "A: next segment"),
        (0x123, "00", "", "00"),
    ],
)
def test_frames_are_named_and_read(identifier: int, data: str, name: str, words: str) -> None:
    frame = NAMES.frame(Carried(0.0, identifier, bytes.fromhex(data), from_drive=False))
    assert (frame.name, frame.words) == (name, words)


def test_pdos_and_emergencies_have_values() -> None:
    data = bytes.fromhex("2702FFFFFFFF09")
    frame = NAMES.frame(Carried(1.5, 0x183, data, from_drive=True))
    assert frame.values == {"6041h": 0x227, "6064h": -1, "6061h": 9}
    assert str(frame).startswith("1.5000 183#2702FFFFFFFF09")
    assert not NAMES.frame(Carried(0.0, 0x183, data[:3], from_drive=True)).values
    emergency = NAMES.frame(Carried(0.0, 0x083, bytes.fromhex("3081110000000000"), from_drive=True))
    assert emergency.values == {"code": 0x8130}
    lost = Carried(0.0, 0x083, b"", from_drive=True, lost=True)
    assert str(NAMES.frame(lost)).endswith("(lost)")


def test_names_stand_for_identifiers() -> None:
    assert NAMES.identifiers("A.tpdo1") == {0x183}
    assert NAMES.identifiers("A.tpdo") == {0x183, 0x283}
    assert NAMES.identifiers("A") == {0x083, 0x183, 0x283, 0x203, 0x303, 0x583, 0x603, 0x703}
    assert NAMES.identifiers("host") == {0x000, 0x080, 0x203, 0x303, 0x603, 0x77F}
    assert NAMES.identifiers(0x123) == {0x123}
    assert not NAMES.identifiers("B")


@given(st.integers(0, 0x7FF), st.binary(max_size=8))
def test_any_frame_can_be_read(identifier: int, data: bytes) -> None:
    frame = NAMES.frame(Carried(0.0, identifier, data, from_drive=True))
    assert frame.data == data
    assert data.hex().upper() in str(frame)
