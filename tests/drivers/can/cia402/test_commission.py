"""Commissioning against the simulated drive over CAN frames: order, read-back and refusals."""

from __future__ import annotations

import itertools
import math
import random
import time

import pytest

from drive_on_bus import CLOCK, Driven, DriveOnBus, device, run_cycles, run_until
from waiting import until
from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.cia402.commission import WatchSpec
from winchkit.drivers.can.cia402.state_machine import DriveState, RequestedState
from winchkit.errors import NoReply, NotPermitted

_marks = itertools.count(1)


def axis_on(bus: CanBus, *, brake: bool = True, node: int = 1, cycle: float = 0.004) -> Cia402Axis:
    watch = WatchSpec(127, 0.2, cycle, brake, prove=False)
    return Cia402Axis(bus, node, device(), watch, CLOCK)


def run_up(rig: Driven, axis: Cia402Axis, velocity: float, above: float) -> None:
    """Cycles until the motor turns faster than ``above`` (rad/s)."""
    shaft = rig[0].shaft
    run_until(rig, axis, RequestedState.ENABLE, lambda: shaft.motor_velocity > above, velocity)


def run_to_rest(rig: Driven, axis: Cia402Axis) -> None:
    """Cycles until the drive is disabled and the motor stands."""
    drive, shaft = rig[0].drive, rig[0].shaft
    run_until(
        rig,
        axis,
        RequestedState.DISABLE,
        lambda: drive.state.name == "SWITCH_ON_DISABLED" and abs(shaft.motor_velocity) < 0.05,
    )


def words_so_far(drive: DriveOnBus, bus: CanBus) -> int:
    """How many control words were sent: frames keep their order, so a last one is waited for."""
    mark = (0x7F0, next(_marks).to_bytes(4, "little"))
    bus.send(*mark)
    until(lambda: mark in drive.frames, 3.0, every=0.001)
    return len(drive.words())


def sdo_writes(drive: DriveOnBus) -> list[tuple[int, int, int]]:
    """Index, sub-index and value of every expedited download, in order."""
    return [
        (int.from_bytes(d[1:3], "little"), d[3], int.from_bytes(d[4:8], "little"))
        for identifier, d in drive.frames
        if identifier == 0x601 and d[0] & 0xE0 == 0x20
    ]


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
    rig: Driven, index: int, value: int, words: str
) -> None:
    drive, bus = rig
    with drive.lock:
        drive.drive.objects.put(index, 0, value)
    with pytest.raises(NotPermitted, match=words):
        axis_on(bus, brake=False).commission()


def test_a_brake_makes_coasting_acceptable_but_not_a_missing_watchdog(rig: Driven) -> None:
    drive, bus = rig
    with drive.lock:
        drive.drive.objects.put(0x605A, 0, 0)
    axis_on(bus, brake=True).commission()
    with drive.lock:
        drive.drive.objects.put(0x6007, 0, 0)
    with pytest.raises(NotPermitted, match="6007h"):
        axis_on(bus, brake=True).commission()


def test_an_absent_drive_is_reported_with_the_node(rig: Driven) -> None:
    with pytest.raises(NoReply, match=r"node 9 1000h.*check power"):
        axis_on(rig[1], node=9).commission()


def test_an_axis_moves_and_reports_si(rig: Driven) -> None:
    drive, bus = rig
    axis = axis_on(bus)
    axis.commission()
    run_until(rig, axis, RequestedState.ENABLE, lambda: axis.state is DriveState.OPERATION_ENABLED)
    feedback = axis.feedback
    assert feedback.velocity == 0.0
    run_until(
        rig,
        axis,
        RequestedState.ENABLE,
        lambda: drive.shaft.motor_velocity == pytest.approx(3.0, rel=0.02),
        velocity=3.0,
    )
    run_cycles(rig, axis, RequestedState.ENABLE, 30, velocity=3.0)
    assert drive.shaft.motor_velocity == pytest.approx(3.0, rel=0.02)
    assert axis.feedback.velocity == pytest.approx(3.0, rel=0.05)
    assert axis.feedback.torque == pytest.approx(0.25, abs=0.01)
    before = words_so_far(drive, bus)
    run_to_rest(rig, axis)
    run_cycles(rig, axis, RequestedState.DISABLE, 5)
    assert axis.feedback.angle == pytest.approx(drive.shaft.motor_angle, abs=0.1)
    assert set(drive.words()[before:]) <= {0x00, 0x02}


def test_garbage_on_the_bus_ends_nothing(rig: Driven) -> None:
    """Frames of every length on every identifier that somebody listens to."""
    drive, bus = rig
    axis = axis_on(bus)
    axis.commission()
    noise = random.Random(7)
    for _ in range(600):
        identifier = noise.choice([0x081, 0x181, 0x281, 0x381, 0x581, 0x701, 0x000, 0x7FF])
        drive.shout(identifier, noise.randbytes(noise.randint(0, 8)))
    run_until(
        rig,
        axis,
        RequestedState.DISABLE,
        lambda: axis.feedback is not None and axis.feedback.state is DriveState.SWITCH_ON_DISABLED,
    )
    assert bus.fault is None
    assert axis.health.short + axis.emergencies.short > 0
    axis.commission()


def test_a_drive_left_enabled_is_stopped_before_anything_else(rig: Driven) -> None:
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


def test_no_snapshot_is_made_of_two_syncs(rig: Driven) -> None:
    """Feedback appears only once both TPDOs of one SYNC are there."""
    _, bus = rig
    axis = axis_on(bus)
    axis.commission()
    axis.begin_cycle(next(_marks), 5.0)
    bus.sync()
    until(lambda: axis.feedback is not None, 3.0, every=0.001)
    assert axis.feedback.time == 5.0
    axis.begin_cycle(next(_marks), 6.0)
    time.sleep(0.02)
    assert axis.feedback.time == 5.0, "without a SYNC nothing new was sampled"
    assert math.isfinite(axis.feedback.torque)


def test_offsets_that_another_master_left_do_not_move_the_drive(rig: Driven) -> None:
    """60B1h is added to the target velocity: at zero the motor would turn."""
    drive, bus = rig
    with drive.lock:
        for index in (0x60B0, 0x60B1, 0x60B2):
            drive.drive.objects.put(index, 0, 3000)
    axis = axis_on(bus)
    axis.commission()
    assert [drive.drive.objects.number(index) for index in (0x60B0, 0x60B1, 0x60B2)] == [0, 0, 0]
    run_until(rig, axis, RequestedState.ENABLE, lambda: axis.state is DriveState.OPERATION_ENABLED)
    run_cycles(rig, axis, RequestedState.ENABLE, 20)
    assert drive.shaft.motor_velocity == pytest.approx(0.0, abs=0.01)


def test_a_drive_that_boots_while_it_is_waited_for_can_be_moved(rig: Driven) -> None:
    """Its boot-up comes after commissioning began, and before anything was set up."""
    drive, bus = rig
    axis = axis_on(bus)
    with drive.lock:
        drive.drive.power_on(time.monotonic(), boot_time=0.2)
    axis.commission()
    assert axis.heartbeat.boot_ups == 1
    assert not axis.mapping_lost
    run_until(rig, axis, RequestedState.ENABLE, lambda: axis.state is DriveState.OPERATION_ENABLED)
