"""Scanning and opening a bus on which somebody misbehaves; the slave shares no code with ours."""

from __future__ import annotations

import errno
import time

import can
import pytest
from canopen.objectdictionary import ODRecord

from makers_rig import Host, axis_on, generic, opened
from winchkit.drivers.can.cia402.commission import set_communication
from winchkit.drivers.can.tools.scan import ScannedNode, scan
from winchkit.drivers.clock import MonotonicClock
from winchkit.errors import ConnectionLost, NotPermitted
from winchkit.schema.bench import BusSpec

SPEC = BusSpec("can", interface="virtual", channel="x")
pytestmark = pytest.mark.realtime


def scanned(bus: object) -> dict[int, ScannedNode]:
    return {item.node: item for item in scan(bus, SPEC, MonotonicClock(), listen=0.3)}  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("fault", "value", "said"),
    [
        ("sdo refused", 0x08000022, "0x08000022"),
        ("silent", None, None),
        ("sdo unheard", None, None),
        ("stopped by a stranger", None, None),
    ],
)
def test_every_node_is_reported_whatever_one_of_them_does(
    fault: str, value: object, said: str | None
) -> None:
    with opened(generic(1), generic(2), generic(3)) as (bus, rig):
        rig.inject(fault, value, slave=1)
        found = scanned(bus)
    assert {1, 3} <= found.keys()
    for node in (1, 3):
        assert (found[node].identity.serial, found[node].problem) == (100 + node, "")
    if said is not None:
        assert said in found[2].problem
    elif 2 in found:
        assert found[2].problem


def test_a_node_that_falls_silent_between_two_answers_is_reported() -> None:
    with opened(generic(1), generic(2)) as (bus, rig):
        slave = rig.slaves[0]
        answer = slave.sdo.answer
        left = iter(range(3))

        def dies(data: bytes) -> bytes | None:
            return answer(data) if next(left, None) is not None else None

        slave.sdo.answer = dies  # type: ignore[method-assign]
        found = scanned(bus)
    assert "no answer" in found[1].problem
    assert found[2].problem == ""


@pytest.mark.parametrize("garbage", [b"", b"\x43", bytes(8), b"\xff" * 8, b"\x43\x18\x10\x01abcd"])
def test_a_node_that_answers_garbage_is_reported(garbage: bytes) -> None:
    with opened(generic(1), generic(2)) as (bus, rig):
        rig.slaves[0].sdo.answer = lambda _data: garbage  # type: ignore[method-assign]
        found = scanned(bus)
    assert found[2].problem == ""
    assert found[1].problem


def test_a_node_that_boots_up_meanwhile_is_asked_again() -> None:
    slave = generic(1)
    with opened(slave) as (bus, rig):
        with rig.lock:
            slave.network.boot_time = 0.15
            slave.power_on()
        found = scanned(bus)
    assert (found[1].device_type, found[1].problem) == (0x20192, "")


def test_two_nodes_of_one_number_are_reported() -> None:
    with opened(generic(1), generic(2)) as (bus, rig):
        rig.inject("two nodes with one number", slave=0)
        found = scanned(bus)
    assert found[1].problem.startswith("two nodes have this number: 2 answers to one request")
    assert found[2].problem == ""


def test_two_nodes_whose_answers_are_one_frame_are_distinguished_by_their_serial_numbers() -> None:
    """Equal frames in the same instant are one on the wire; the serial numbers differ."""
    with opened(generic(1)) as (bus, rig):
        rig.inject("two nodes with one number")
        twin = rig.slaves[0].twin
        answer = twin.sdo.answer
        twin.sdo.answer = lambda data: answer(data) if data[1:4] == b"\x18\x10\x04" else None  # type: ignore[method-assign]
        found = scanned(bus)
    assert "two nodes have this number: 2 answers to one request (1018h:4)" in found[1].problem


def test_a_drive_that_stays_stopped_is_named_as_such() -> None:
    with opened(generic(1)) as (bus, rig):
        time.sleep(0.1)
        with rig.lock:
            rig.slaves[0].objects.set(0x1017, 0, 50)
            rig.slaves[0].network.written(0x1017, 0, rig.slaves[0].time)
        rig.inject("stopped by a stranger")
        rig.inject("nmt unheard")
        with pytest.raises(ConnectionLost, match="is NMT stopped"):
            axis_on(bus).commission()


def test_a_drive_that_produces_sync_is_reported_and_stops_producing() -> None:
    slave = generic(1)
    slave.objects.declare(0x1005, 0, 0x07, 0x40000080)
    slave.objects.declare(0x1014, 0, 0x07, 0x80000081)
    with opened(slave) as (bus, _):
        axis = axis_on(bus)
        drive = axis.commission()
    assert slave.objects.get(0x1005) == 0x80
    assert slave.objects.get(0x1014) == 0x81
    sync, emergency = drive.notes
    assert "the drive produces SYNC" in sync
    assert "EMCY was not received" in emergency


def test_a_drive_that_will_not_stop_producing_sync_is_refused() -> None:
    slave = generic(1)
    slave.objects.declare(0x1005, 0, 0x07, 0x40000080, access="ro")
    with opened(slave) as (bus, _):
        axis = axis_on(bus)
        with pytest.raises(NotPermitted, match="produces SYNC and does not accept 80h"):
            set_communication(axis.objects)


def test_sync_of_somebody_else_is_counted() -> None:
    with opened(generic(1)) as (bus, rig):
        bus.sync()
        time.sleep(0.05)
        assert (bus.foreign_syncs, bus.foreign_sync) == (0, "")
        with rig.lock:
            for _ in range(3):
                rig._bus.send(can.Message(arbitration_id=0x80, is_extended_id=False))
        time.sleep(0.1)
        assert bus.foreign_syncs == bus.health.foreign_syncs == 3
        assert "3 SYNC frames that were not sent here" in bus.foreign_sync


def test_pdos_above_four_are_switched_off() -> None:
    """CiA 301: bit 31 of the identifier."""
    slave = generic(1)
    for record in (0x1404, 0x1804, 0x1806):
        slave.objects.declare(record, 0, 0x05, 2)
        slave.objects.declare(record, 1, 0x07, 0x501)
        slave.objects.declare(record, 2, 0x05, 255)
    with opened(slave) as (bus, _):
        axis = axis_on(bus)
        dictionary = axis.objects.dictionary
        for record in (0x1404, 0x1804, 0x1806):
            dictionary.add_object(ODRecord("a PDO beyond four", record))
        axis.commission()
    for record in (0x1404, 0x1804, 0x1806):
        assert slave.objects.get(record, 1) >> 31 == 1


def test_an_emergency_without_a_fault_stands_until_it_is_gone() -> None:
    with opened(generic(1)) as (bus, rig):
        axis = axis_on(bus)
        axis.commission()
        with Host(bus, axis):
            rig.inject("emergency", 0x4210)
            time.sleep(0.1)
            assert axis.alarms == (0x4210,)
            assert "EMCY 4210h drive over-temperature" in axis.emergencies.standing
            with rig.lock:
                rig.slaves[0].emergency.clear()
            time.sleep(0.1)
            assert axis.emergencies.standing == ""


@pytest.mark.parametrize("number", [errno.ENOBUFS, errno.EAGAIN])
def test_a_full_queue_is_no_dead_bus_unless_it_stays_full(
    number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    with opened(generic(1)) as (bus, _):
        send = bus._port.send

        def full(_identifier: int, _data: bytes) -> None:
            raise OSError(number, "no buffer space available")

        monkeypatch.setattr(bus._port, "send", full)
        assert bus.send(0x201, b"\x06\x00") is False
        bus.heartbeat(127, 5)
        assert (bus.unsent, bus.fault, bus.beats[127]) == (2, None, 0)
        monkeypatch.setattr(bus._port, "send", send)
        assert bus.send(0x201, b"\x06\x00") is True
        monkeypatch.setattr(bus._port, "send", full)
        bus.send(0x201, b"\x06\x00")
        time.sleep(0.15)
        with pytest.raises(ConnectionLost):
            bus.send(0x201, b"\x06\x00")
        assert bus.fault


def test_a_full_queue_leaves_a_guarding_poll_out(monkeypatch: pytest.MonkeyPatch) -> None:
    with opened(generic(1)) as (bus, _):
        send = bus._port.send_remote

        def full(_identifier: int) -> None:
            raise OSError(errno.ENOBUFS, "no buffer space available")

        monkeypatch.setattr(bus._port, "send_remote", full)
        bus.remote(0x701)
        assert (bus.unsent, bus.fault) == (1, None)
        time.sleep(0.15)
        monkeypatch.setattr(bus._port, "send_remote", send)
        bus.remote(0x701)
        monkeypatch.setattr(bus._port, "send_remote", full)
        bus.remote(0x701)
        assert bus.fault is None, "the queue was not full all the time"
        time.sleep(0.15)
        with pytest.raises(ConnectionLost):
            bus.remote(0x701)
        assert bus.fault


def test_a_full_queue_delays_an_sdo_request(monkeypatch: pytest.MonkeyPatch) -> None:
    with opened(generic(1)) as (bus, _):
        axis = axis_on(bus)
        library = bus._port.library
        send, full = library.send, iter(range(5))

        def some_full(message: can.Message, timeout: float | None = None) -> None:
            if next(full, None) is not None:
                raise can.CanOperationError("full", error_code=errno.ENOBUFS)
            send(message, timeout)

        monkeypatch.setattr(library, "send", some_full)
        assert axis.objects.read(0x1018, 4) == 101
