"""PDO layout against bit-by-bit packing, heartbeats in simulated time, emergencies in words."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.drivers.can.canopen.emergency import error_text, parse_emergency
from winchkit.drivers.can.canopen.nmt import HeartbeatConsumer, HeartbeatProducer, NmtState
from winchkit.drivers.can.canopen.pdo import MappedObject, PdoCodec, parse_object
from winchkit.errors import FileError
from winchkit.schema.devices.servo import PdoSpec


@st.composite
def mapping_with_values(draw: st.DrawFn) -> tuple[list[MappedObject], list[int]]:
    sizes = draw(
        st.lists(st.sampled_from([8, 16, 32]), min_size=1, max_size=8).filter(
            lambda bits: sum(bits) <= 64
        )
    )
    objects, values = [], []
    for number, bits in enumerate(sizes):
        signed = draw(st.booleans())
        low = -(1 << bits - 1) if signed else 0
        values.append(draw(st.integers(low, low + (1 << bits) - 1)))
        objects.append(MappedObject(0x6000 + number, number, bits, signed))
    return objects, values


@given(mapping_with_values())
def test_layout_is_little_endian_in_the_order_of_the_mapping(
    given_mapping: tuple[list[MappedObject], list[int]],
) -> None:
    objects, values = given_mapping
    codec = PdoCodec(PdoSpec(1, ()), objects)
    number = shift = 0
    for item, value in zip(objects, values, strict=True):
        number |= (value % (1 << item.bits)) << shift
        shift += item.bits
    frame = number.to_bytes(shift // 8, "little")
    assert codec.encode(values) == frame
    assert codec.decode(frame + b"padding"[: 8 - len(frame)]) == tuple(values)
    assert codec.decode(frame[:-1]) is None


@pytest.mark.parametrize(
    "objects", [[], [MappedObject(0x6064, 0, 32, True)] * 3, [MappedObject(0x1008, 0, 24, False)]]
)
def test_mappings_that_no_frame_can_carry_are_refused(objects: list[MappedObject]) -> None:
    with pytest.raises(FileError, match="PDO 2"):
        PdoCodec(PdoSpec(2, ()), objects)


def test_objects_are_written_as_the_standard_writes_them() -> None:
    assert parse_object("0x6091:1") == (0x6091, 1)
    assert MappedObject(0x6064, 0, 32, True).entry == 0x60640020
    with pytest.raises(FileError, match="0x6064"):
        parse_object("position")


def test_watch_arms_on_the_first_heartbeat() -> None:
    watch = HeartbeatConsumer(0.2)
    assert not watch.lost(1e9)
    watch.receive(bytes([NmtState.OPERATIONAL]), 10.0)
    assert not watch.lost(10.2)
    assert watch.lost(10.21)
    assert watch.age(10.5) == 0.5
    watch.receive(b"\x00", 11.0)
    assert watch.boot_ups == 1
    watch.receive(b"", 12.0)
    assert watch.last == 11.0


@given(st.lists(st.floats(1e-4, 0.3), min_size=20, max_size=200))
def test_producer_beats_as_often_as_it_is_asked_and_no_more(steps: list[float]) -> None:
    """At its period while asked often enough; a loop that hangs sends no catch-up burst."""
    producer, now, beats = HeartbeatProducer(0.05), 0.0, []
    for step in steps:
        now += step
        if producer.due(now):
            beats.append(now)
    for before, after in zip(beats, beats[2:], strict=False):
        assert after - before > 0.05 - 1e-9
    longest = max(steps)
    for before, after in itertools.pairwise(beats):
        assert after - before <= 0.05 + longest + 1e-9


def test_emergencies_in_words() -> None:
    emergency = parse_emergency(bytes.fromhex("308110") + b"vendr", 1.0)
    assert emergency is not None
    assert emergency.code == 0x8130
    assert "lost the host" in str(emergency)
    assert parse_emergency(b"\x30\x81", 1.0) is None
    assert "following error" in error_text(0x8611)
    assert "temperature" in error_text(0x42FF)
