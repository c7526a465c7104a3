"""What a bus counts, how it dies, and how it is opened again under the same objects."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator, Sequence
from typing import Any

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drive_on_bus import DriveOnBus, bus_spec, device
from waiting import run_together, until
from winchkit.drivers.can.bus import bus as bus_module
from winchkit.drivers.can.bus.bus import CanBus, FrameTime
from winchkit.drivers.can.bus.health import BusHealth, BusState, ErrorTally
from winchkit.drivers.can.bus.socketcan import ReceivedFrame
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.cia402.commission import WatchSpec
from winchkit.drivers.can.cia402.state_machine import DriveState, RequestedState
from winchkit.drivers.clock import MonotonicClock
from winchkit.errors import ConnectionLost

CLOCK = MonotonicClock()
Commissioned = tuple[DriveOnBus, CanBus, Cia402Axis]


def test_an_exception_of_a_handler_is_a_fault_of_the_bus_that_names_it() -> None:
    """The receive thread ends; the control loop latches the fault, and a reset opens it again."""
    spec = bus_spec()
    bus = CanBus(spec, "can", CLOCK)
    other = can.Bus(interface=spec.interface, channel=spec.channel)
    heard: list[bytes] = []
    try:
        bus.on(0x181, lambda data, _now: heard.append(data[7:8] or data[8]))  # type: ignore[arg-type]
        other.send(can.Message(arbitration_id=0x181, data=bytes(2), is_extended_id=False))
        until(lambda: bus.fault is not None)
        assert "internal error" in (bus.fault or "")
        assert "181h: IndexError" in (bus.fault or "")
        until(lambda: bus.health.state is BusState.DOWN)
        bus.reopen()
        assert bus.fault is None
        other.send(can.Message(arbitration_id=0x181, data=bytes(8), is_extended_id=False))
        until(lambda: bool(heard))
    finally:
        other.shutdown()
        bus.close()


# Error frames as the kernel's header can/error.h lays them out.


@pytest.mark.parametrize(
    ("identifier", "detail", "state", "counts"),
    [
        (0x004, 0x01, BusState.ACTIVE, (0, 0, 1)),  # receive buffer overflow
        (0x004, 0x04, BusState.WARNING, (0, 0, 0)),
        (0x004, 0x08, BusState.WARNING, (0, 0, 0)),
        (0x004, 0x10, BusState.PASSIVE, (0, 1, 0)),
        (0x004, 0x20, BusState.PASSIVE, (0, 1, 0)),
        (0x040, 0x00, BusState.OFF, (1, 0, 0)),
        (0x0AA, 0x00, BusState.ACTIVE, (0, 0, 0)),  # protocol, transceiver, acknowledge
    ],
)
def test_error_frames_of_socketcan(
    identifier: int, detail: int, state: BusState, counts: tuple[int, int, int]
) -> None:
    tally = ErrorTally()
    tally.take(identifier, bytes((0, detail, 0, 0, 0, 0, 0, 0)))
    assert tally.state is state
    assert (tally.bus_off, tally.error_passive, tally.overruns) == counts
    assert tally.frames == 1


def test_a_controller_that_recovers_is_active_again() -> None:
    tally = ErrorTally()
    for identifier, detail in ((4, 0x10), (4, 0x10), (0x40, 0), (0x100, 0), (4, 0x20), (4, 0x40)):
        tally.take(identifier, bytes((0, detail)))
    assert tally.state is BusState.ACTIVE
    assert (tally.error_passive, tally.bus_off) == (2, 1)


@given(st.lists(st.tuples(st.integers(0, 0x1FF), st.binary(max_size=8)), max_size=30))
def test_no_error_frame_ends_the_counting(frames: list[tuple[int, bytes]]) -> None:
    tally = ErrorTally()
    for identifier, data in frames:
        tally.take(identifier, data)
    assert tally.frames == len(frames)
    assert tally.overruns <= len(frames)


# Time stamps of another clock.


@given(
    offset=st.floats(-1e9, 1e9),
    delays=st.lists(st.floats(0.0, 0.005), min_size=30, max_size=100),
    drift=st.floats(-1e-4, 1e-4),
)
def test_stamps_are_mapped_within_the_least_delay_and_never_into_the_future(
    offset: float, delays: list[float], drift: float
) -> None:
    """Two clocks, one of them 100 ppm off at most; frames handed over up to 5 ms late."""
    times, mapped, best = FrameTime(), 0.0, 1.0
    for number, delay in enumerate(delays):
        sent = 1000.0 + 0.004 * number
        now = sent + delay
        best = min(best, delay)
        mapped = times.map(2e9 + offset + sent * (1 + drift), now)
        assert mapped <= now + 1e-6
        elapsed = 0.004 * number
        assert sent - 2e-6 - 1e-4 * elapsed <= mapped + 1e-6
        assert mapped <= sent + best + 4e-4 * elapsed + 2e-6


class PlainTimes:
    """The rules of ``FrameTime`` one after another, without regard to their cost."""

    offset: float | None = None
    last = 0.0
    late_since: float | None = None
    stamp = 0.0

    def map(self, stamp: float, now: float) -> float:
        if stamp <= 0.0:
            return now
        seen = now - stamp
        went_back, self.stamp = stamp < self.stamp, stamp
        before = seen if self.offset is None else self.offset
        late = seen - before
        if late > 0.02:
            since = stamp if self.late_since is None else self.late_since
            was_set = went_back or stamp - since >= 0.25
            self.offset, self.late_since = (seen, None) if was_set else (before, since)
        else:
            most = 2e-4 * max(0.0, now - self.last)
            self.offset, self.late_since = before + min(late, most) if late >= 0 else seen, None
        self.last = now
        return max(stamp + self.offset, now - 0.1)


@given(
    frames=st.lists(
        st.tuples(
            st.sampled_from([0.0, 0.0, 0.0, 0.004, 0.02, 0.3]),
            st.sampled_from([0.0, 0.0, 1e-4, 0.001, 0.019, 0.05, 0.2, -0.5, 0.5]),
            st.sampled_from([True, True, True, False]),
        ),
        max_size=60,
    )
)
def test_several_frames_of_a_reception_are_mapped_as_one_by_one(
    frames: list[tuple[float, float, bool]],
) -> None:
    tested, plain, now = FrameTime(), PlainTimes(), 50.0
    for step, delay, stamped in frames:
        now += step
        stamp = now + 1000.0 - delay if stamped else 0.0
        assert tested.map(stamp, now) == plain.map(stamp, now)


def test_a_frame_that_was_read_late_is_as_old_as_it_is() -> None:
    """A receive thread that was held up for 60 ms, then a backlog, then nothing special."""
    times = FrameTime()
    assert times.map(500.0, 10.0) == 10.0
    for stamp in (500.010, 500.020, 500.060):
        assert times.map(stamp, 10.070) == pytest.approx(stamp - 490.0, abs=3e-5)
    assert times.map(500.100, 10.101) == pytest.approx(10.1, abs=3e-5)


@pytest.mark.parametrize("step", [-3600.0, -0.5, -0.05, 0.5, 3600.0])
def test_a_clock_that_is_set_is_followed_at_once(step: float) -> None:
    """As by NTP during a motion: the time between two frames is that of the drive, to the delay of
    one; a speed is integrated over it."""
    times, last = FrameTime(), -0.004
    for number in range(400):
        sent = 0.004 * number
        stamp = 9000.0 + sent + (step if number >= 100 else 0.0)
        mapped = times.map(stamp, sent + 1e-4 * (number % 7))
        assert mapped - last == pytest.approx(0.004, abs=7e-4)
        last = mapped


def test_a_frame_without_a_stamp_has_the_time_of_its_reception() -> None:
    times = FrameTime()
    assert times.map(0.0, 14.0) == 14.0


# A bus that dies and comes back.


class Interface:
    """An interface whose troubles the test makes up."""

    def __init__(self) -> None:
        self.library: Any = can.Bus(interface="virtual", channel=f"unused-{id(self)}")
        self.dropped = 0
        self.frames: list[ReceivedFrame] = []
        self.sent: list[tuple[int, bytes]] = []
        self.trouble: Exception | None = None
        self.room = self.calls = 0
        """Frames that one call takes, and calls of many frames."""
        self.refused: tuple[int, bytes] | None = None
        self.closed = False
        self.controller: BusState | None = None

    def receive(self, timeout: float) -> list[ReceivedFrame]:
        if self.trouble is not None:
            raise self.trouble
        if not self.frames:
            time.sleep(0.001)
            return []
        return [self.frames.pop(0)]

    def send(self, identifier: int, data: bytes) -> None:
        if self.trouble is not None:
            raise self.trouble
        if (identifier, data) == self.refused:
            raise OSError(105, "No buffer space available")
        self.sent.append((identifier, data))

    def send_together(self, frames: Sequence[tuple[int, bytes]]) -> int:
        took = 0 if self.trouble is not None else min(self.room, len(frames))
        self.sent += frames[:took]
        self.calls += 1
        return took

    def state(self) -> BusState | None:
        return self.controller

    def close(self) -> None:
        self.closed = True
        self.trouble = can.CanOperationError("Cannot operate on a closed bus")
        self.library.shutdown()


@pytest.fixture
def interfaces(monkeypatch: pytest.MonkeyPatch) -> list[Interface]:
    opened: list[Interface] = []

    def open_one(*_: object) -> Interface:
        opened.append(Interface())
        return opened[-1]

    monkeypatch.setattr(bus_module, "open_interface", open_one)
    return opened


@pytest.fixture
def bus(interfaces: list[Interface]) -> Iterator[CanBus]:
    bus = CanBus(bus_spec(), "can", CLOCK)
    yield bus
    bus.close()


def test_everything_that_goes_wrong_is_counted(bus: CanBus, interfaces: list[Interface]) -> None:
    port = interfaces[0]
    bus.sync()
    port.dropped = 3
    port.frames += [
        ReceivedFrame(0x181, b""),
        ReceivedFrame(0x004, bytes((0, 0x01)), error=True),
        ReceivedFrame(0x004, bytes((0, 0x10)), error=True),
        ReceivedFrame(0x701, b"\x05"),
    ]
    until(lambda: bus.received == 2)
    health = bus.health
    assert (health.received, health.sent, health.dropped, health.overruns) == (2, 1, 3, 1)
    assert (health.error_frames, health.error_passive, health.state) == (2, 1, BusState.PASSIVE)
    assert not health.lossless
    assert "error passive: received 2, sent 1, error frames 2" in str(health)
    assert bus.nodes == {1}
    assert BusHealth().lossless


@pytest.fixture
def commissioned() -> Iterator[Commissioned]:
    """A drive, the bus to it, and its axis."""
    spec = bus_spec()
    with DriveOnBus(spec) as drive:
        bus = CanBus(spec, "can", CLOCK)
        try:
            axis = Cia402Axis(bus, 1, device(), WatchSpec(127, 0.2, 0.004, True), CLOCK)
            axis.commission()
            yield drive, bus, axis
        finally:
            bus.close()


CYCLE = [(0x201, b"a"), (0x202, b"b"), (0x203, b"c")]


@pytest.mark.parametrize("room", [0, 1, 3, 8])
def test_the_frames_of_a_cycle_are_sent_together_and_in_their_order(
    bus: CanBus, interfaces: list[Interface], room: int
) -> None:
    """What one call does not take is sent one by one; other frames do not wait for it."""
    port = interfaces[0]
    port.room = room
    bus.post(*CYCLE[0])
    assert port.sent == CYCLE[:1], "nobody gathers"
    bus.gather()
    for frame in CYCLE:
        bus.post(*frame)
    bus.sync()
    assert port.sent == [*CYCLE[:1], (0x080, b"")]
    bus.send_gathered()
    assert port.sent[2:] == CYCLE
    assert (bus.sent, port.calls) == (5, 1)
    bus.gather()
    bus.send_gathered()
    bus.post(*CYCLE[1])
    assert port.sent[5:] == [CYCLE[1]], "once sent, nothing is gathered"


def test_an_emergency_stop_takes_back_the_command_that_waits(commissioned: Commissioned) -> None:
    """Nothing of the cycle follows its quick stop; by what the drive receives."""
    drive, bus, axis = commissioned
    enable(commissioned, velocity=0.0)
    axis.begin_cycle(25, CLOCK.now())
    bus.gather()
    axis.send(RequestedState.ENABLE, velocity=3.0)
    bus.post(0x202, b"other")
    axis.emergency_stop(sdo=False)
    until(lambda: (0x201, axis._stop_frames[0][1]) in drive.frames)
    bus.send_gathered()
    until(lambda: (0x202, b"other") in drive.frames)
    mine = [data for identifier, data in drive.frames if identifier == 0x201]
    assert mine[-1] == axis._stop_frames[0][1]


def test_a_full_queue_leaves_out_what_it_does_not_take(
    bus: CanBus, interfaces: list[Interface]
) -> None:
    port = interfaces[0]
    port.room, port.refused = 1, CYCLE[1]
    bus.gather()
    for frame in CYCLE:
        bus.post(*frame)
    bus.send_gathered()
    assert port.sent == [CYCLE[0], CYCLE[2]]
    assert (bus.unsent, bus.fault) == (1, None)


def test_a_dead_interface_is_reported_once_every_frame_was_tried(
    bus: CanBus, interfaces: list[Interface]
) -> None:
    bus.gather()
    for frame in CYCLE:
        bus.post(*frame)
    interfaces[0].trouble = OSError(100, "Network is down")
    with pytest.raises(ConnectionLost, match=r"cannot send: .*Network is down"):
        bus.send_gathered()
    assert bus.unsent == len(CYCLE)


def test_bus_off_is_a_fault_until_it_is_opened_again(
    bus: CanBus, interfaces: list[Interface]
) -> None:
    interfaces[0].frames += [ReceivedFrame(0x040, bytes(8), error=True)]
    until(lambda: bus.fault is not None)
    assert "bus off" in str(bus.fault)
    interfaces[0].frames += [ReceivedFrame(0x100, bytes(8), error=True)]
    until(lambda: bus.health.state is BusState.ACTIVE)
    assert bus.fault is not None, "a restart of the controller makes nothing right by itself"
    bus.reopen()
    assert bus.fault is None
    assert bus.health.bus_off == 1


def test_a_controller_s_own_word_counts_where_it_gives_one(
    bus: CanBus, interfaces: list[Interface]
) -> None:
    interfaces[0].controller = BusState.PASSIVE
    until(lambda: bus.health.state is BusState.PASSIVE)


@pytest.mark.parametrize(
    "trouble",
    [can.CanOperationError("gone", 100), OSError(19, "No such device"), ValueError("closed")],
)
def test_an_unplugged_adapter_is_reported_and_replaced(
    bus: CanBus, interfaces: list[Interface], trouble: Exception
) -> None:
    heard: list[bytes] = []
    bus.on(0x181, lambda data, _now: heard.append(data))
    interfaces[0].trouble = trouble
    until(lambda: bus.fault is not None)
    until(lambda: bus.health.state is BusState.DOWN)
    with pytest.raises(ConnectionLost, match="bus 'can': cannot send"):
        bus.sync()
    assert bus.health.unsent == 1
    bus.reopen()
    assert interfaces[0].closed
    assert bus.fault is None
    assert interfaces[1].sent == [], "opening a bus says nothing on it"
    interfaces[1].frames.append(ReceivedFrame(0x181, b"alive"))
    until(lambda: heard == [b"alive"])
    bus.sync()
    assert interfaces[1].sent == [(0x080, b"")]
    assert (bus.health.reopened, bus.health.state) == (1, BusState.ACTIVE)


def test_an_interface_that_stays_away_is_reported_each_time(
    bus: CanBus, interfaces: list[Interface], monkeypatch: pytest.MonkeyPatch
) -> None:
    def gone(*_: object) -> Interface:
        raise ConnectionLost("bus 'can': cannot open it")

    with monkeypatch.context() as patch:
        patch.setattr(bus_module, "open_interface", gone)
        for _ in range(2):
            with pytest.raises(ConnectionLost, match="cannot open it"):
                bus.reopen()
            assert bus.fault is not None
            with pytest.raises(ConnectionLost):
                bus.sync()
    bus.reopen()
    assert bus.fault is None


def test_a_drive_is_found_again_after_its_bus_was_reopened(commissioned: Commissioned) -> None:
    """Axis and handlers stay; nothing is enabled by it; the drive has stopped by itself."""
    drive, bus, axis = commissioned
    enable(commissioned, velocity=3.0)
    last = bus.sent
    until(lambda: drive.frames[-1][0] == 0x201)
    before = len(drive.frames)
    bus.reopen()
    assert bus.sent == last
    until(lambda: abs(drive.shaft.motor_velocity) < 0.05)
    until(lambda: drive.drive.state.name == "SWITCH_ON_DISABLED")
    assert drive.frames[before:] == []
    axis.commission()
    enable(commissioned, velocity=-3.0)


def enable(commissioned: Commissioned, velocity: float) -> None:
    """A control loop in miniature, until the drive has this velocity (rad/s)."""
    drive, bus, axis = commissioned
    for number in range(1500):
        reached = drive.shaft.motor_velocity == pytest.approx(velocity, rel=0.05, abs=0.01)
        if reached and axis.state is DriveState.OPERATION_ENABLED:
            return
        axis.begin_cycle(number, CLOCK.now())
        bus.sync()
        bus.heartbeat(127, 5)
        time.sleep(0.006)
        axis.send(RequestedState.ENABLE, velocity=velocity)
    raise AssertionError(f"the drive is {axis.state}, at {drive.shaft.motor_velocity} rad/s")


def test_sending_from_several_threads_loses_nothing(
    bus: CanBus, interfaces: list[Interface]
) -> None:
    threads = [
        threading.Thread(target=lambda n=n: [bus.send(0x200 + n, bytes((k,))) for k in range(200)])
        for n in range(4)
    ]
    run_together(threads)
    for number in range(4):
        data = [d[0] for i, d in interfaces[0].sent if i == 0x200 + number]
        assert data == list(range(200))
