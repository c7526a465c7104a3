"""What is wrong with canopen's BaseNode402 (decision 6), each shown to be right here."""

from __future__ import annotations

import struct
import threading
import time
from pathlib import Path

import pytest

from drive_on_bus import CLOCK, Driven, device, run_cycles, run_until
from hand_made import NODE, RPDO, HandMade, codec
from waiting import run_together, until
from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.canopen.nmt import NmtState
from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.cia402.commission import WatchSpec
from winchkit.drivers.can.cia402.state_machine import DriveState, RequestedState
from winchkit.errors import ConnectionLost, DeviceRefused, NoReply, NotPermitted


@pytest.fixture
def axis(rig: Driven) -> Cia402Axis:
    watch = WatchSpec(127, 0.2, 0.004, True, prove=False)
    axis = Cia402Axis(rig[1], 1, device(), watch, CLOCK)
    axis.commission()
    return axis


def node_on(bus: CanBus, node: int = 1) -> SdoNode:
    spec = device()
    return SdoNode(bus, node, Path(spec.path).parent / spec.servo.eds)


@pytest.mark.parametrize(
    "requested",
    [
        RequestedState.STOP,
        RequestedState.DISABLE,
        RequestedState.RUN_DOWN,
        RequestedState.HALT,
        RequestedState.RESET,
    ],
)
def test_1_a_stop_of_a_disabled_drive_energises_nothing(
    rig: Driven, axis: Cia402Axis, requested: RequestedState
) -> None:
    """BaseNode402 goes through operation enabled on its way to quick stop active."""
    assert run_cycles(rig, axis, requested, 20) == {"SWITCH_ON_DISABLED"}


@pytest.mark.parametrize("option", [2, 6])
def test_2_a_quick_stop_is_not_followed_by_enabling(
    rig: Driven, axis: Cia402Axis, option: int
) -> None:
    with rig[0].lock:
        rig[0].drive.objects.put(0x605A, 0, option)
    drive, shaft = rig[0].drive, rig[0].shaft
    moving = DriveState.OPERATION_ENABLED
    run_until(
        rig,
        axis,
        RequestedState.ENABLE,
        lambda: axis.state is moving and shaft.motor_velocity > 1.0,
        velocity=2.0,
    )
    run_until(rig, axis, RequestedState.STOP, lambda: drive.state.name != "OPERATION_ENABLED")
    after = run_cycles(rig, axis, RequestedState.STOP, 70)
    after |= run_until(rig, axis, RequestedState.STOP, lambda: abs(shaft.motor_velocity) < 0.05)
    assert "OPERATION_ENABLED" not in after


def test_3_a_reset_ends_disabled(rig: Driven, axis: Cia402Axis) -> None:
    with rig[0].lock:
        rig[0].drive.inject("over-current")
    drive = rig[0].drive
    run_until(rig, axis, RequestedState.DISABLE, lambda: axis.state is DriveState.FAULT)
    assert drive.state.name == "FAULT"
    seen = run_until(
        rig, axis, RequestedState.RESET, lambda: drive.state.name == "SWITCH_ON_DISABLED"
    )
    seen |= run_cycles(rig, axis, RequestedState.RESET, 20)
    assert seen <= {"FAULT", "SWITCH_ON_DISABLED"}
    assert drive.state.name == "SWITCH_ON_DISABLED"


def test_4_a_refused_mode_is_an_error(rig: Driven, axis: Cia402Axis) -> None:
    """And nothing was written for it."""
    drive, _ = rig
    run_cycles(rig, axis, RequestedState.DISABLE, 3)
    missing = next(m for m in ("IP", "CST", "PT", "XX") if m not in axis.drive.modes)
    before = len(drive.frames)
    with pytest.raises(NotPermitted, match=f"no mode {missing}; it has PP"):
        axis.switch_mode(missing)
    sdo = [data for i, data in drive.frames[before:] if i == 0x601]
    assert all(data[0] >> 5 == 2 for data in sdo), "6502h is read again for the message"
    assert axis.mode == "CSV"


def test_4_a_mode_that_the_drive_does_not_take_is_an_error(rig: Driven, axis: Cia402Axis) -> None:
    """It accepts 6060h and goes on showing the old one."""
    drive, _ = rig
    run_cycles(rig, axis, RequestedState.DISABLE, 3)
    with drive.lock:
        drive.drive.objects.watchers[0x6060] = lambda _sub, _value: None
        shown = drive.drive.objects
        original = shown.read
        shown.read = lambda key: b"\x09" if key == (0x6061, 0) else original(key)  # type: ignore[method-assign]
    with pytest.raises(NotPermitted, match=r"6061h \(.*\) shows CSV 0.5 s after PV"):
        axis.switch_mode("PV")
    assert axis.mode == "CSV"


def test_5_the_control_word_is_sent_every_cycle(rig: Driven, axis: Cia402Axis) -> None:
    drive, bus = rig
    run_cycles(rig, axis, RequestedState.DISABLE, 5)
    sent = bus.sent
    run_cycles(rig, axis, RequestedState.DISABLE, 10)
    until(lambda: sum(i < 0x580 or i > 0x700 for i, _ in drive.frames) >= bus.sent)
    assert bus.sent == sent + 30, "SYNC, heartbeat and command"
    cycles = [i for i, _ in drive.frames if i in (0x080, 0x201)]
    assert cycles[-20:] == [0x080, 0x201] * 10


def test_6_a_cycle_costs_no_sdo_and_silence_is_not_a_state(rig: Driven, axis: Cia402Axis) -> None:
    drive, bus = rig
    assert axis.feedback is None
    assert axis.state is DriveState.UNKNOWN
    before = len(drive.frames)
    assert axis.send(RequestedState.ENABLE) == 0
    run_until(rig, axis, RequestedState.ENABLE, lambda: axis.state is DriveState.OPERATION_ENABLED)
    assert [i for i, _ in drive.frames[before:] if i == 0x601] == []
    assert bus.fault is None


def test_7_sub_indices_of_one_object_are_kept_apart() -> None:
    made = codec(1, (0x60C1, 1), (0x60C1, 2))
    assert made.decode(struct.pack("<ii", 7, -8)) == (7, -8)
    assert made.position == {(0x60C1, 1): 0, (0x60C1, 2): 1}


def test_7_pre_operational_is_not_operational() -> None:
    """As a substring it is."""
    made = HandMade(rpdo=RPDO)
    made.bus.deliver(0x700 + NODE, bytes([NmtState.PRE_OPERATIONAL]))
    assert not made.axis.operational
    made.bus.deliver(0x700 + NODE, bytes([NmtState.OPERATIONAL | 0x80]))
    assert made.axis.operational


def test_8_sdo_of_four_threads_do_not_mix(rig: Driven) -> None:
    """The library's own client failed 50 of 600 times."""
    _, bus = rig
    node = node_on(bus)
    for sub in (1, 2):
        node.write(0x607D, sub, 1000 * sub)
    wrong: list[object] = []

    def work(index: int) -> None:
        try:
            for number in range(40):
                if index % 2:
                    found = node.read(0x607D, 1 + number % 2)
                    if found != 1000 * (1 + number % 2):
                        wrong.append(found)
                elif node.read(0x1000) & 0xFFFF != 402:
                    wrong.append("device type")
                if number % 10 == index:
                    node.write_verified(0x6083 + index % 2, 0, 5000 + number)
        except (ConnectionLost, NotPermitted) as error:
            if "6083" not in str(error) and "6084" not in str(error):
                wrong.append(error)

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    run_together(threads)
    assert wrong == []


def test_8_a_write_that_is_not_answered_is_not_written_again(
    rig: Driven, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It may have arrived: the effect of a second one is unknown."""
    drive, bus = rig
    monkeypatch.setattr(drive.drive, "_serve_sdo", lambda _data, _now: None)
    node = node_on(bus)
    with pytest.raises(NoReply, match=r"6083h.*no answer within 0.5 s"):
        node.write(0x6083, 0, 77)
    until(lambda: len(drive.frames) >= 2)
    requests = [d for i, d in drive.frames if i == 0x601]
    assert [d[0] >> 5 for d in requests] == [1, 4], "one download, and an abort"


def test_8_an_answer_that_came_too_late_is_not_the_next_one_s(
    rig: Driven, monkeypatch: pytest.MonkeyPatch
) -> None:
    drive, bus = rig
    held: list[bytes] = []
    serve = drive.drive._serve_sdo
    monkeypatch.setattr(drive.drive, "_serve_sdo", lambda data, _now: held.append(data))
    node = node_on(bus)
    with pytest.raises(NoReply):
        node.read(0x1000)
    monkeypatch.setattr(drive.drive, "_serve_sdo", serve)
    with drive.lock:
        drive.drive._serve_sdo(held[0], time.monotonic())
    time.sleep(0.02)
    assert node.read(0x1017) == drive.drive.objects.number(0x1017)


def test_8_one_node_s_silence_does_not_hold_up_another(rig: Driven) -> None:
    _, bus = rig
    silent, alive = node_on(bus, 9), node_on(bus, 1)
    ended = threading.Event()

    def ask() -> None:
        with pytest.raises(NoReply):
            silent.read(0x1000)
        ended.set()

    thread = threading.Thread(target=ask)
    thread.start()
    values = [alive.read(0x1000) & 0xFFFF for _ in range(5)]
    assert not ended.is_set(), "five answers within the other's 0.5 s"
    thread.join()
    assert values == [402] * 5


def test_8_aborts_are_reported_in_words(rig: Driven) -> None:
    node = node_on(rig[1])
    words = r"6041h \(Statusword\).*refused to write 1 to it: Code 0x06010002, .*read"
    with pytest.raises(DeviceRefused, match=words):
        node.write(0x6041, 0, 1)
    assert node.read_if_there(0x5FFF) is None
    with pytest.raises(NotPermitted, match="70000 does not fit into its 16 bits"):
        node.write(0x6040, 0, 70_000)
