"""The proof that a drive notices a dead host, before anything is enabled."""

from __future__ import annotations

import threading
import time

import pytest

from drive_on_bus import CLOCK, Driven, DriveOnBus, bus_spec, device
from waiting import until
from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.canopen.nmt import NmtState
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.cia402.commission import WatchSpec
from winchkit.drivers.can.cia402.state_machine import DriveState, RequestedState
from winchkit.errors import NotPermitted

HOST, HEARTBEAT = 127, 0.05


def axis_on(
    bus: CanBus, node: int = 1, *, prove: bool = True, heartbeat: float = HEARTBEAT
) -> Cia402Axis:
    watch = WatchSpec(HOST, heartbeat, 0.004, True, prove=prove)
    return Cia402Axis(bus, node, device(), watch, CLOCK)


def put(drive: DriveOnBus, index: int, sub: int, value: int) -> None:
    with drive.lock:
        drive.drive.objects.put(index, sub, value)


@pytest.mark.slow
@pytest.mark.parametrize("lost", [1, 2, 3])
@pytest.mark.parametrize("behaviour", [0, 1, 2])
def test_a_drive_that_watches_is_operational_and_disabled_again(
    rig: Driven, lost: int, behaviour: int
) -> None:
    """Whatever it does at the loss: fault, disable, quick stop; pre-operational, stopped."""
    drive, bus = rig
    put(drive, 0x6007, 0, lost)
    put(drive, 0x1029, 1, behaviour)
    axis = axis_on(bus)
    proof = axis.commission().proof
    assert proof.emergency is None or proof.emergency.code == 0x8130
    assert proof.emergency is not None or proof.nmt != NmtState.OPERATIONAL
    assert proof.limit == pytest.approx(0.1)
    assert proof.delay >= proof.limit - 0.005
    assert drive.drive.state.name == "SWITCH_ON_DISABLED"
    assert drive.drive.nmt.name == "OPERATIONAL"
    assert drive.drive.error_code == 0
    assert drive.drive.objects.number(0x1016, 1) == HOST << 16 | 125
    assert list(axis.emergencies) == []
    enabling = [w for w in control_words(drive) if w & 0x0F in (0x06, 0x07, 0x0F)]
    assert enabling == [], "nothing climbs while the watchdog is proved"


def control_words(drive: DriveOnBus) -> list[int]:
    """Every control word that came, by SDO or PDO."""
    by_sdo = [d for i, d in drive.frames if i == 0x601 and d[1:4] == b"\x40\x60\x00"]
    return [int.from_bytes(d[4:6], "little") for d in by_sdo if d[0] != 0x40] + drive.words()


def test_a_drive_that_only_says_that_it_watches_is_refused(rig: Driven) -> None:
    """It takes 1016h and reads it back, and then never looks at the clock."""
    drive, bus = rig
    with drive.lock:
        drive.drive._heartbeats.heard = lambda *_: None  # type: ignore[method-assign]
    axis = axis_on(bus)
    with pytest.raises(NotPermitted, match=r"1016h:1.*neither EMCY 8130h nor left operational"):
        axis.commission()
    assert axis.feedback is None
    axis_on(bus, prove=False).commission()


@pytest.mark.realtime  # a stall of the thread that beats is a lost heartbeat
def test_the_proof_disturbs_no_other_node_on_the_bus() -> None:
    """Another drive, armed on the host whose heartbeat goes on meanwhile, notices nothing.

    The heartbeat is slow against what one thread of a process waits for another.
    """
    spec, over, slow = bus_spec(), threading.Event(), 4 * HEARTBEAT
    with DriveOnBus(spec, 1) as first, DriveOnBus(spec, 2) as second:
        bus = CanBus(spec, "can", CLOCK)

        def beat() -> None:
            while not over.wait(slow / 8):
                bus.heartbeat(HOST, 5)

        host = threading.Thread(target=beat)
        host.start()
        try:
            axis = axis_on(bus, heartbeat=slow)
            axis.commission()
            first.frames.clear()
            proof = axis_on(bus, 2, heartbeat=slow).commission().proof
            assert proof is not None
            strangers = {i - 0x700 for i, _ in first.frames if i > 0x700}
            assert len(strangers - {2, HOST}) == 1
            assert list(axis.emergencies) == []
            assert first.drive.nmt.name == second.drive.nmt.name == "OPERATIONAL"
        finally:
            over.set()
            host.join()
            bus.close()


def test_it_costs_less_than_a_second_with_a_heartbeat_of_100_ms(rig: Driven) -> None:
    """On a bus of its own the drive's answer comes within its limit of 0.1 s and a poll."""
    _, bus = rig
    watch = WatchSpec(HOST, 0.1, 0.004, True)
    proof = Cia402Axis(bus, 1, device(), watch, CLOCK).commission().proof
    assert proof.delay < 1.0


def test_a_host_that_falls_silent_is_noticed_afterwards(rig: Driven) -> None:
    """The proof leaves the host's own entry armed by its first heartbeat."""
    _, bus = rig
    axis = axis_on(bus)
    axis.commission()
    bus.heartbeat(HOST, 5)
    until(lambda: bool(axis.emergencies), 3.0)
    assert axis.emergencies[0].code == 0x8130


def test_nothing_is_enabled_before_the_host_s_heartbeat_began(rig: Driven) -> None:
    """Unarmed, the drive would go on moving after a host that died at once."""
    drive, bus = rig
    axis = axis_on(bus)
    axis.commission()
    for number in range(1500):
        if axis.state is DriveState.OPERATION_ENABLED:
            break
        axis.begin_cycle(number, CLOCK.now())
        bus.sync()
        if number == 10:
            assert drive.drive.state.name == "SWITCH_ON_DISABLED"
        if number >= 10:
            bus.heartbeat(HOST, 5)
        time.sleep(0.006)
        axis.send(RequestedState.ENABLE)
    assert axis.state is DriveState.OPERATION_ENABLED
