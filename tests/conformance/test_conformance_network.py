"""The network on a bus: set-up, boot-ups, heartbeats both ways, emergencies, a lost mapping."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from bus_rig import HEARTBEAT, Rig
from drive_server import HOST, NODE
from master import Master
from winchkit.drivers.can.canopen.nmt import NmtState
from winchkit.drivers.can.cia402.state_machine import DriveState, RequestedState

pytestmark = pytest.mark.realtime

_INVALID = 1 << 31


@pytest.fixture
def master(rig: Rig) -> Iterator[Master]:
    with Master(rig) as opened:
        opened.commission()
        yield opened


def test_pdos_are_set_up_in_the_order_of_the_standard(rig: Rig, master: Master) -> None:
    writes = rig.witness.writes()
    for record, mapping, entries in (
        (0x1800, 0x1A00, [0x60410010, 0x60640020, 0x60610008]),
        (0x1801, 0x1A01, [0x606C0020, 0x60770010, 0x603F0010]),
        (0x1400, 0x1600, [0x60400010, 0x60FF0020]),
        (0x1401, 0x1601, [0x607A0020]),
    ):
        own = [write for write in writes if write[0] in (record, mapping)]
        assert own[0][:2] == (record, 1)
        assert own[0][2] & _INVALID, "switched off first"
        at = own.index((mapping, 0, 0))
        assert {index for index, _, _ in own[1:at]} <= {record}, "then its timing"
        assert (record, 2) in {write[:2] for write in own[1:at]}
        mapped = own[at + 1 : at + 1 + len(entries)]
        assert mapped == [(mapping, sub, entry) for sub, entry in enumerate(entries, start=1)]
        assert own[at + 1 + len(entries)] == (mapping, 0, len(entries))
        assert own[-1][:2] == (record, 1)
        assert not own[-1][2] & _INVALID, "switched on last"
    started = [frame for frame in rig.witness.frames if frame.identifier == 0x000]
    assert started[-1].data == bytes((1, NODE)), "and only then started"


def test_watchdogs_and_cycle_are_in_the_drive(rig: Rig, master: Master) -> None:
    number = rig.drive.number
    assert number(0x1016, 1) == HOST << 16 | round(master.watch.timeout * 1e3)
    assert number(0x1017) == round(HEARTBEAT * 1e3)
    cycle = number(0x60C2, 1) * 10.0 ** number(0x60C2, 2)
    assert cycle == pytest.approx(rig.transport.cycle)
    assert number(0x6007) != 0


def test_the_drives_watch_is_proved_before_it_may_be_enabled(rig: Rig) -> None:
    """A heartbeat is withheld once, from a drive that is disabled, and the drive complains."""
    rig.forget()
    with Master(rig, prove=True) as master:
        master.commission()
        frames, words = rig.witness.frames, rig.witness.words()
        complaints = [
            f for f in frames if f.identifier == 0x080 + NODE and f.data[:2] == b"\x30\x81"
        ]
        assert complaints
        assert set(words) <= {0x00, 0x02}
        assert set(rig.states()) <= {"SWITCH_ON_DISABLED"}
        assert rig.drive.number(0x1016, 1) >> 16 == HOST
        assert master.state is DriveState.SWITCH_ON_DISABLED
        assert master.axis.operational


def test_a_boot_up_is_noticed_and_the_mapping_known_to_be_lost(rig: Rig, master: Master) -> None:
    before = master.axis.heartbeat.boot_ups
    rig.forget()
    rig.drive.inject("reboot")
    rig.until(lambda: master.axis.heartbeat.boot_ups == before + 1)
    boot = [f for f in rig.witness.frames if f.identifier == 0x700 + NODE and f.data == b"\0"]
    assert len(boot) == 1
    assert not master.axis.operational
    assert rig.drive.number(0x1016, 1) == 0
    stale = master.axis.feedback
    master.cycles(RequestedState.DISABLE, 10)
    assert master.axis.feedback is stale, "nothing new comes from a drive without its mapping"
    master.commission()
    master.cycles(RequestedState.DISABLE, 3)
    assert master.axis.operational
    assert master.state is DriveState.SWITCH_ON_DISABLED
    assert master.axis.feedback is not stale


def test_a_reset_of_its_communication_is_noticed_too(rig: Rig, master: Master) -> None:
    before = master.axis.heartbeat.boot_ups
    rig.witness.send(0x000, bytes((0x82, NODE)))
    rig.until(lambda: master.axis.heartbeat.boot_ups == before + 1)
    assert not master.axis.operational


def test_the_hosts_silence_stops_the_drive(rig: Rig, master: Master) -> None:
    master.until(RequestedState.ENABLE, DriveState.OPERATION_ENABLED)
    master.cycles(RequestedState.ENABLE, 20, velocity=4.0)
    assert rig.drive.see()["velocity"] > 3.0
    master.cycles_silent(1)
    rig.forget()
    rig.until(lambda: rig.state() == "SWITCH_ON_DISABLED")
    seen = rig.drive.see()
    assert rig.states()[:3] == ["OPERATION_ENABLED", "QUICK_STOP_ACTIVE", "SWITCH_ON_DISABLED"]
    stopped = seen["record"][1][0] - seen["host_heard"]
    # A busy machine may keep the drive itself from looking at its clock for a while.
    assert master.watch.timeout - 0.01 <= stopped <= master.watch.timeout + 2 * seen["worst_gap"]
    assert abs(seen["velocity"]) < 0.05
    codes = [f.data[:2] for f in rig.witness.frames if f.identifier == 0x080 + NODE]
    assert codes[0] == b"\x30\x81", "EMCY 8130h"
    assert not rig.witness.words()


def test_the_drives_silence_is_noticed(rig: Rig, master: Master) -> None:
    master.cycles(RequestedState.DISABLE, 3)
    assert not master.axis.heartbeat.lost(master.clock.now())
    rig.drive.inject("heartbeat stop")
    master.await_silently(lambda: master.axis.heartbeat.lost(master.clock.now()))
    assert rig.drive.see()["nmt"] == "OPERATIONAL", "everything else goes on"
    rig.drive.inject("recover")
    master.await_silently(lambda: not master.axis.heartbeat.lost(master.clock.now()))
    assert master.axis.heartbeat.state == NmtState.OPERATIONAL


@pytest.mark.parametrize(
    ("kind", "code"),
    [("over-current", 0x2310), ("following error", 0x8611), ("under-voltage", 0x3220)],
)
def test_emergencies_arrive_in_words(rig: Rig, master: Master, kind: str, code: int) -> None:
    master.until(RequestedState.ENABLE, DriveState.OPERATION_ENABLED)
    rig.forget()
    rig.drive.inject(kind)
    master.until(RequestedState.DISABLE, DriveState.FAULT)
    master.cycles(RequestedState.DISABLE, 2)
    assert master.axis.emergencies[-1].code == code
    assert f"{code:04X}h" in master.axis.fault_text
    assert rig.drive.see()["error"] == code
    raw = [f.data for f in rig.witness.frames if f.identifier == 0x080 + NODE]
    assert raw[0][:2] == code.to_bytes(2, "little")
    assert len(raw[0]) == 8
