"""Commissioning against the simulated drive over CAN frames: order, read-back and refusals."""

from __future__ import annotations

import itertools
import math
import random
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from drive_on_bus import DriveOnBus, bus_spec, device
from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.cia402.commission import WatchSpec
from winchkit.drivers.can.cia402.state_machine import DriveState, RequestedState
from winchkit.drivers.clock import MonotonicClock
from winchkit.errors import DeviceRefused, NoReply, NotPermitted

CLOCK = MonotonicClock()
Rig = tuple[DriveOnBus, CanBus]
_syncs = itertools.count(1)


@pytest.fixture
def rig() -> Iterator[Rig]:
    spec = bus_spec()
    with DriveOnBus(spec) as drive:
        bus = CanBus(spec, "can", CLOCK)
        try:
            yield drive, bus
        finally:
            bus.close()


def axis_on(bus: CanBus, *, brake: bool = True, node: int = 1, cycle: float = 0.004) -> Cia402Axis:
    watch = WatchSpec(127, 0.2, cycle, brake, prove=False)
    return Cia402Axis(bus, node, device(), watch, CLOCK)


def run_cycles(
    bus: CanBus, axis: Cia402Axis, requested: RequestedState, count: int, velocity: float = 0
) -> None:
    """A control loop in miniature."""
    for _ in range(count):
        axis.begin_cycle(next(_syncs), CLOCK.now())
        bus.sync()
        bus.heartbeat(127, 5)
        time.sleep(0.006)
        axis.send(requested, velocity=velocity)


def run_until(
    condition: Callable[[], bool],
    bus: CanBus,
    axis: Cia402Axis,
    requested: RequestedState,
    velocity: float = 0,
) -> None:
    """Cycles until something holds, however late the thread of the drive is run."""
    for _ in range(1500):
        if condition():
            return
        run_cycles(bus, axis, requested, 1, velocity)
    raise AssertionError(f"it did not come to that; the drive is {axis.state}")


def run_up(rig: Rig, axis: Cia402Axis, velocity: float, above: float) -> None:
    """Cycles until the motor turns faster than ``above`` (rad/s)."""
    drive, bus = rig
    run_until(
        lambda: drive.shaft.motor_velocity > above, bus, axis, RequestedState.ENABLE, velocity
    )


def run_to_rest(drive: DriveOnBus, bus: CanBus, axis: Cia402Axis) -> None:
    """Cycles until the drive is disabled and the motor stands."""
    run_until(
        lambda: (
            drive.drive.state.name == "SWITCH_ON_DISABLED"
            and abs(drive.shaft.motor_velocity) < 0.05
        ),
        bus,
        axis,
        RequestedState.DISABLE,
    )


def words_so_far(drive: DriveOnBus, bus: CanBus) -> int:
    """How many control words were sent: frames keep their order, so a last one is waited for."""
    mark = (0x7F0, next(_syncs).to_bytes(4, "little"))
    bus.send(*mark)
    deadline = time.monotonic() + 3.0
    while mark not in drive.frames:
        assert time.monotonic() < deadline
        time.sleep(0.001)
    return len(drive.words())


def sdo_writes(drive: DriveOnBus) -> list[tuple[int, int, int]]:
    """Index, sub-index and value of every expedited download, in order."""
    return [
        (int.from_bytes(d[1:3], "little"), d[3], int.from_bytes(d[4:8], "little"))
        for identifier, d in drive.frames
        if identifier == 0x601 and d[0] & 0xE0 == 0x20
    ]


def test_pdos_are_set_up_in_the_order_of_the_standard(rig: Rig) -> None:
    drive, bus = rig
    axis_on(bus).commission()
    writes = sdo_writes(drive)
    for record, mapping, count in ((0x1800, 0x1A00, 3), (0x1401, 0x1601, 1)):
        own = [w for w in writes if w[0] in (record, mapping)]
        assert own[0][2] >> 31 == 1, "disabled first"
        assert own[1][:2] == (record, 2)
        assert own[2] == (mapping, 0, 0)
        assert [w[1] for w in own[3:-2]] == list(range(1, count + 1))
        assert own[-2] == (mapping, 0, count)
        assert own[-1][2] >> 31 == 0, "enabled last"


def test_watchdogs_and_cycle_are_in_the_drive_afterwards(rig: Rig) -> None:
    drive, bus = rig
    axis_on(bus, cycle=0.005).commission()
    number = drive.drive.objects.number
    assert number(0x1016, 1) == 127 << 16 | 500
    assert number(0x1017) == 200
    assert number(0x60C2, 1) * 10.0 ** number(0x60C2, 2) == pytest.approx(0.005)
    assert number(0x6061) == 9
    assert drive.drive.state.name == "SWITCH_ON_DISABLED"


@pytest.mark.parametrize(
    ("index", "value", "words"),
    [
        (0x6007, 0, "go on moving when the host dies"),
        (0x6007, 2, "coasts"),
        (0x605A, 0, "quick stop the motor coasts"),
        (0x605B, 0, "shutdown the motor coasts"),
        (0x605E, 0, "fault the motor coasts"),
    ],
)
def test_a_drive_that_would_drop_the_load_is_refused(
    rig: Rig, index: int, value: int, words: str
) -> None:
    drive, bus = rig
    with drive.lock:
        drive.drive.objects.put(index, 0, value)
    with pytest.raises(NotPermitted, match=words):
        axis_on(bus, brake=False).commission()


def test_a_brake_makes_coasting_acceptable_but_not_a_missing_watchdog(rig: Rig) -> None:
    drive, bus = rig
    with drive.lock:
        drive.drive.objects.put(0x605A, 0, 0)
    axis_on(bus, brake=True).commission()
    with drive.lock:
        drive.drive.objects.put(0x6007, 0, 0)
    with pytest.raises(NotPermitted, match="6007h"):
        axis_on(bus, brake=True).commission()


def test_a_mode_that_the_drive_lacks_is_refused(rig: Rig) -> None:
    drive, bus = rig
    with drive.lock:
        drive.drive.objects.put(0x6502, 0, 0x05)
    with pytest.raises(NotPermitted, match="no mode CSV; it has PP, PV"):
        axis_on(bus).commission()


def test_an_absent_drive_is_reported_with_the_node(rig: Rig) -> None:
    with pytest.raises(NoReply, match=r"node 9 1000h.*check power"):
        axis_on(rig[1], node=9).commission()


def test_an_abort_carries_its_text_and_its_object(rig: Rig) -> None:
    _, bus = rig
    spec = device()
    assert spec.servo is not None
    node = SdoNode(bus, 1, Path(spec.path).parent / spec.servo.eds)
    with pytest.raises(DeviceRefused, match=r"6041h \(Statusword\).*0x06010002"):
        node.write(0x6041, 0, 1)
    assert node.read_if_there(0x5FFF) is None


def test_an_axis_moves_and_reports_si(rig: Rig) -> None:
    drive, bus = rig
    axis = axis_on(bus)
    axis.commission()
    run_until(lambda: axis.state is DriveState.OPERATION_ENABLED, bus, axis, RequestedState.ENABLE)
    feedback = axis.feedback
    assert feedback is not None
    assert feedback.velocity == 0.0
    run_until(
        lambda: drive.shaft.motor_velocity == pytest.approx(3.0, rel=0.02),
        bus,
        axis,
        RequestedState.ENABLE,
        velocity=3.0,
    )
    run_cycles(bus, axis, RequestedState.ENABLE, 30, velocity=3.0)
    assert drive.shaft.motor_velocity == pytest.approx(3.0, rel=0.02)
    assert axis.feedback is not None
    assert axis.feedback.velocity == pytest.approx(3.0, rel=0.05)
    assert axis.feedback.torque == pytest.approx(0.25, abs=0.01)
    before = words_so_far(drive, bus)
    run_to_rest(drive, bus, axis)
    run_cycles(bus, axis, RequestedState.DISABLE, 5)
    assert axis.feedback.angle == pytest.approx(drive.shaft.motor_angle, abs=0.1)
    assert set(drive.words()[before:]) <= {0x00, 0x02}


@pytest.mark.parametrize("code", [1, 2, 5, 6])
def test_stops_end_disabled_whatever_605a_says(rig: Rig, code: int) -> None:
    """Codes 5 to 8 stay in quick stop active until they are led out of it, at rest."""
    drive, bus = rig
    with drive.lock:
        drive.drive.objects.put(0x605A, 0, code)
    axis = axis_on(bus)
    axis.commission()
    run_up(rig, axis, velocity=5.0, above=3.0)
    before = words_so_far(drive, bus)
    run_to_rest(drive, bus, axis)
    run_cycles(bus, axis, RequestedState.DISABLE, 20)
    assert drive.drive.state.name == "SWITCH_ON_DISABLED"
    assert set(drive.words()[before:]) <= {0x00, 0x02}
    assert abs(drive.shaft.motor_velocity) < 0.05


def test_garbage_on_the_bus_ends_nothing(rig: Rig) -> None:
    """Frames of every length on every identifier that somebody listens to."""
    drive, bus = rig
    axis = axis_on(bus)
    axis.commission()
    noise = random.Random(7)
    for _ in range(600):
        identifier = noise.choice([0x081, 0x181, 0x281, 0x381, 0x581, 0x701, 0x000, 0x7FF])
        drive.shout(identifier, noise.randbytes(noise.randint(0, 8)))
    run_until(
        lambda: axis.feedback is not None and axis.feedback.state is DriveState.SWITCH_ON_DISABLED,
        bus,
        axis,
        RequestedState.DISABLE,
    )
    assert bus.fault is None
    assert axis.health.short + axis.emergencies.short > 0
    axis.commission()


def test_a_drive_left_enabled_is_stopped_before_anything_else(rig: Rig) -> None:
    drive, bus = rig
    axis = axis_on(bus)
    axis.commission()
    other = axis_on(bus)
    run_up(rig, axis, velocity=2.0, above=1.0)
    drive.frames.clear()
    other.commission()
    controls = [w for w in sdo_writes(drive) if w[0] == 0x6040]
    assert controls
    assert all(value & 0xFFFF == 2 for _, _, value in controls)
    assert sdo_writes(drive)[0][0] == 0x6040
    assert abs(drive.shaft.motor_velocity) < 0.05


def test_no_snapshot_is_made_of_two_syncs(rig: Rig) -> None:
    """Feedback appears only once both TPDOs of one SYNC are there."""
    _, bus = rig
    axis = axis_on(bus)
    axis.commission()
    axis.begin_cycle(next(_syncs), 5.0)
    bus.sync()
    deadline = time.monotonic() + 3.0
    while axis.feedback is None:
        assert time.monotonic() < deadline
        time.sleep(0.001)
    assert axis.feedback.time == 5.0
    axis.begin_cycle(next(_syncs), 6.0)
    time.sleep(0.02)
    assert axis.feedback.time == 5.0, "without a SYNC nothing new was sampled"
    assert math.isfinite(axis.feedback.torque)


def test_offsets_that_another_master_left_do_not_move_the_drive(rig: Rig) -> None:
    """60B1h is added to the target velocity: at zero the motor would turn."""
    drive, bus = rig
    with drive.lock:
        for index in (0x60B0, 0x60B1, 0x60B2):
            drive.drive.objects.put(index, 0, 3000)
    axis = axis_on(bus)
    axis.commission()
    assert [drive.drive.objects.number(index) for index in (0x60B0, 0x60B1, 0x60B2)] == [0, 0, 0]
    run_until(lambda: axis.state is DriveState.OPERATION_ENABLED, bus, axis, RequestedState.ENABLE)
    run_cycles(bus, axis, RequestedState.ENABLE, 20)
    assert drive.shaft.motor_velocity == pytest.approx(0.0, abs=0.01)


def test_a_drive_that_boots_while_it_is_waited_for_can_be_moved(rig: Rig) -> None:
    """Its boot-up comes after commissioning began, and before anything was set up."""
    drive, bus = rig
    axis = axis_on(bus)
    with drive.lock:
        drive.drive.power_on(time.monotonic(), boot_time=0.2)
    axis.commission()
    assert axis.heartbeat.boot_ups == 1
    assert not axis.mapping_lost
    run_until(lambda: axis.state is DriveState.OPERATION_ENABLED, bus, axis, RequestedState.ENABLE)
