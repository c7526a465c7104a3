"""PDOs against bit-by-bit packing, with their types and timers; heartbeats and emergencies."""

from __future__ import annotations

import dataclasses
import itertools
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drive_on_bus import DriveOnBus, bus_spec, device
from hand_made import Objects, codec
from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.canopen.emergency import error_text, parse_emergency
from winchkit.drivers.can.canopen.nmt import HeartbeatConsumer, HeartbeatProducer, NmtState
from winchkit.drivers.can.canopen.pdo import MappedObject, PdoCodec, parse_object
from winchkit.drivers.can.canopen.pdo_parameters import cob_id, set_up
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.cia402.commission import WatchSpec
from winchkit.drivers.can.cia402.state_machine import DriveState, RequestedState
from winchkit.drivers.clock import MonotonicClock
from winchkit.errors import DeviceRefused, FileError
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.devices.servo import PdoSpec
from winchkit.schema.read import read_device


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
    assert emergency.code == 0x8130
    assert "lost the host" in str(emergency)
    assert parse_emergency(b"\x30\x81", 1.0) is None
    assert "following error" in error_text(0x8611)
    assert "temperature" in error_text(0x42FF)


CLOCK = MonotonicClock()


class Records(Objects):
    """Four PDOs of each direction, as a drive of node 1 has them."""

    node = 1
    dictionary: frozenset[int] = frozenset()

    def __init__(self) -> None:
        records: dict[int | tuple[int, int], int] = {}
        for base, first in ((0x1400, 0x201), (0x1800, 0x181)):
            for number in range(4):
                records[base + number, 1] = first + 0x100 * number
                for sub in (2, 3, 5):
                    records[base + number, sub] = 255 if sub == 2 else 0
                for sub in range(9):
                    records[base + 0x200 + number, sub] = 0
        super().__init__(records)


def with_timers(transmission: int, inhibit: float, event: float) -> object:
    made = codec(1, 0x6041, 0x6064)
    made.spec = PdoSpec(1, made.spec.objects, transmission, event, inhibit)
    return made


def test_an_event_driven_pdo_is_written_in_the_order_of_the_standard() -> None:
    """COB-ID off, type, inhibit time, event timer, count 0, entries, count, COB-ID on."""
    node = Records()
    set_up(node, "tpdo", (with_timers(255, 0.0023, 0.05),))  # type: ignore[arg-type]
    own = [w for w in node.written if w[0] in (0x1800, 0x1A00)]
    assert own == [
        (0x1800, 1, 0xC0000181),
        (0x1800, 2, 255),
        (0x1800, 3, 23),
        (0x1800, 5, 50),
        (0x1A00, 0, 0),
        (0x1A00, 1, 0x60410010),
        (0x1A00, 2, 0x60640020),
        (0x1A00, 0, 2),
        (0x1800, 1, 0x40000181),
    ]
    others = [w for w in node.written if w not in own]
    assert [(i, s, v >> 31) for i, s, v in others] == [(0x1801 + k, 1, 1) for k in range(3)]


@pytest.mark.parametrize("transmission", [0, 1, 2, 240])
def test_synchronous_pdos_leave_the_timers_alone(transmission: int) -> None:
    node = Records()
    set_up(node, "tpdo", (with_timers(transmission, 0.0, 0.0),))  # type: ignore[arg-type]
    assert node.values[0x1800, 2] == transmission
    assert [w for w in node.written if w[1] in (3, 5) and w[0] == 0x1800] == []


def test_a_drive_that_changes_its_cob_id_is_refused() -> None:
    node = Records()
    node.refuses = lambda index, sub, value: (index, sub) == (0x1800, 1) and not value >> 31
    with pytest.raises(DeviceRefused, match="1800h:1"):
        set_up(node, "tpdo", (with_timers(1, 0.0, 0.0),))  # type: ignore[arg-type]


def test_identifiers_of_the_predefined_connection_set() -> None:
    assert [cob_id("tpdo", n, 5) for n in (1, 2, 3, 4)] == [0x185, 0x285, 0x385, 0x485]
    assert [cob_id("rpdo", n, 5) for n in (1, 2, 3, 4)] == [0x205, 0x305, 0x405, 0x505]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("transmission = 241", "241 is reserved; use 1 to 240"),
        ("transmission = 253", "253 answers remote requests only"),
        ("transmission = 256", "a whole number from 0 to 255"),
        ('event_timer = "10 ms"', "has no effect with transmission 1"),
        ('transmission = 2\ninhibit_time = "1 ms"', "has no effect with transmission 2"),
    ],
)
def test_types_that_cannot_work_are_faults_of_the_file(
    tmp_path: Path, line: str, words: str
) -> None:
    source = Path(device().path)
    (tmp_path / "generic-cia402.eds").write_text((source.parent / "generic-cia402.eds").read_text())
    text = source.read_text().replace(
        "[[servo.tpdo]]\nnumber = 1", f"[[servo.tpdo]]\n{line}\nnumber = 1"
    )
    path = tmp_path / "device.toml"
    path.write_text(text)
    with pytest.raises(FileError, match=words):
        read_device(path)


@pytest.fixture
def rig() -> Iterator[tuple[DriveOnBus, CanBus]]:
    spec = bus_spec()
    with DriveOnBus(spec) as drive:
        bus = CanBus(spec, "can", CLOCK)
        yield drive, bus
        bus.close()


def with_second_tpdo(transmission: int, event_timer: float) -> DeviceSpec:
    """The generic drive, its TPDO 2 (velocity, torque, error) sent less often."""
    spec = device()
    first, second = spec.servo.tpdo
    slower = dataclasses.replace(second, transmission=transmission, event_timer=event_timer)
    return dataclasses.replace(spec, servo=dataclasses.replace(spec.servo, tpdo=(first, slower)))


@pytest.mark.realtime
@pytest.mark.parametrize(("transmission", "event_timer"), [(3, 0.0), (255, 0.01)])
def test_a_drive_is_moved_with_slower_feedback_of_its_speed(
    rig: tuple[DriveOnBus, CanBus], transmission: int, event_timer: float
) -> None:
    _, bus = rig
    spec = with_second_tpdo(transmission, event_timer)
    axis = Cia402Axis(bus, 1, spec, WatchSpec(127, 0.2, 0.004, True, prove=False), CLOCK)
    axis.commission()
    for number in range(50):
        axis.begin_cycle(number, CLOCK.now())
        bus.sync()
        bus.heartbeat(127, 5)
        time.sleep(0.006)
        axis.send(RequestedState.ENABLE, velocity=3.0)
    assert axis.state is DriveState.OPERATION_ENABLED
    assert axis.feedback.velocity == pytest.approx(3.0, rel=0.05)
    assert axis.health.complete >= 45
