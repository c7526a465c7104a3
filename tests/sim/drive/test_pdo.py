"""PDOs of the simulated drive: canopen's own set-up, the standard's order, SYNC and events."""

from __future__ import annotations

import struct

import pytest
from canopen.sdo.exceptions import SdoAbortedError

from drive_rig import COUNT, NODE, Flywheel, Rig

STATE, NOT_MAPPABLE, TOO_LONG, UNKNOWN = 0x08000022, 0x06040041, 0x06040042, 0x06020000
DISABLED = 1 << 31
TPDO1, TPDO2, RPDO1 = 0x180 + NODE, 0x280 + NODE, 0x200 + NODE


@pytest.fixture
def rig() -> Rig:
    rig = Rig(Flywheel(motor_angle=1.0, motor_torque=0.5))
    rig.node.nmt.send_command(0x01)
    return rig


def refusal(rig: Rig, index: int, sub: int, value: int) -> int:
    with pytest.raises(SdoAbortedError) as refused:
        rig.write(index, sub, value)
    return int(refused.value.code)


def remap(rig: Rig, number: int, *entries: int, kind: int = 1, transmit: bool = True) -> None:
    """Map in the order of CiA 301."""
    record = (0x1800 if transmit else 0x1400) + number
    mapping = record + 0x200
    cob = rig.read(record, 1)
    rig.write(record, 1, cob | DISABLED)
    rig.write(record, 2, kind)
    rig.write(mapping, 0, 0)
    for sub, entry in enumerate(entries, start=1):
        rig.write(mapping, sub, entry)
    rig.write(mapping, 0, len(entries))
    rig.write(record, 1, cob & ~DISABLED)


def test_sync_brings_the_mapped_objects(rig: Rig) -> None:
    rig.send(0x080, b"")
    (first,) = rig.sent(TPDO1)
    status, position, mode = struct.unpack("<Hib", first)
    assert (status & 0x6F, position, mode) == (0x40, round(1.0 / COUNT), 0)
    (second,) = rig.sent(TPDO2)
    assert struct.unpack("<ihH", second) == (0, 250, 0)


def test_nothing_is_sent_on_sync_outside_operational(rig: Rig) -> None:
    for command in (0x80, 0x02):
        rig.node.nmt.send_command(command)
        rig.send(0x080, b"")
    assert not rig.sent(TPDO1)


def test_a_received_pdo_takes_effect_with_the_next_sync(rig: Rig) -> None:
    rig.write(0x6060, 0, 9)
    for word in (0x06, 0x07, 0x0F):
        rig.send(RPDO1, struct.pack("<Hi", word, 50_000))
        before = rig.status & 0x6F
        rig.run(0.01)
        assert rig.status & 0x6F == before
        rig.send(0x080, b"")
    assert rig.status & 0x6F == 0x27
    rig.run(0.01)
    assert rig.read(0x606C) == 50_000


def test_an_event_driven_received_pdo_takes_effect_at_once(rig: Rig) -> None:
    remap(rig, 0, 0x60400010, 0x60FF0020, kind=255, transmit=False)
    rig.send(RPDO1, struct.pack("<Hi", 0x06, 0))
    assert rig.status & 0x6F == 0x21


def test_a_short_received_pdo_is_reported_and_ignored(rig: Rig) -> None:
    rig.send(RPDO1, b"\x06\x00")
    rig.send(0x080, b"")
    assert rig.emergencies() == [0x8210]
    assert rig.status & 0x6F == 0x40


def test_canopen_can_read_and_save_a_map_of_its_own(rig: Rig) -> None:
    rig.node.tpdo.read()
    pdo = rig.node.tpdo[3]
    pdo.clear()
    pdo.add_variable(0x6064)
    pdo.add_variable(0x60F4)
    pdo.trans_type = 2
    pdo.enabled = True
    pdo.save()
    cob = pdo.cob_id
    for _ in range(4):
        rig.send(0x080, b"")
    assert len(rig.sent(cob)) == 2
    assert struct.unpack("<ii", rig.sent(cob)[0]) == (round(1.0 / COUNT), 0)


def test_a_map_cannot_change_while_its_pdo_is_valid(rig: Rig) -> None:
    assert refusal(rig, 0x1A00, 0, 0) == STATE
    assert refusal(rig, 0x1A00, 1, 0x60640020) == STATE
    assert refusal(rig, 0x1800, 1, 0x40000190) == STATE
    assert refusal(rig, 0x1800, 3, 100) == STATE


def test_a_map_cannot_change_while_it_counts_entries(rig: Rig) -> None:
    rig.write(0x1800, 1, rig.read(0x1800, 1) | DISABLED)
    assert refusal(rig, 0x1A00, 1, 0x60640020) == STATE
    rig.write(0x1A00, 0, 0)
    rig.write(0x1A00, 1, 0x60640020)


@pytest.mark.parametrize(
    ("index", "entry", "code"),
    [
        (0x1A02, 0x50000010, UNKNOWN),
        (0x1A02, 0x60640010, NOT_MAPPABLE),
        (0x1A02, 0x605A0010, NOT_MAPPABLE),
        (0x1602, 0x60410010, NOT_MAPPABLE),
        (0x1602, 0x00050003, NOT_MAPPABLE),
    ],
)
def test_what_cannot_be_mapped_is_refused(rig: Rig, index: int, entry: int, code: int) -> None:
    assert refusal(rig, index, 1, entry) == code


def test_a_map_longer_than_a_frame_is_refused(rig: Rig) -> None:
    for sub, entry in enumerate((0x60640020, 0x606C0020, 0x60770010), start=1):
        rig.write(0x1A02, sub, entry)
    assert refusal(rig, 0x1A02, 0, 3) == TOO_LONG
    rig.write(0x1A02, 0, 2)


def test_a_gap_is_filled_by_a_dummy(rig: Rig) -> None:
    remap(rig, 2, 0x00070020, 0x60400010, kind=255, transmit=False)
    rig.send(0x400 + NODE, struct.pack("<IH", 0xDEADBEEF, 0x06))
    assert rig.status & 0x6F == 0x21


@pytest.mark.parametrize("kind", [241, 251])
def test_reserved_transmission_types_are_refused(rig: Rig, kind: int) -> None:
    assert refusal(rig, 0x1800, 2, kind) == 0x06090030


@pytest.mark.parametrize("every", [1, 3, 240])
def test_a_synchronous_pdo_comes_with_every_nth_sync(rig: Rig, every: int) -> None:
    remap(rig, 0, 0x60410010, kind=every)
    for _ in range(480):
        rig.send(0x080, b"")
    assert len(rig.sent(TPDO1)) == 480 // every


def test_type_0_is_sent_at_the_sync_after_a_change_only(rig: Rig) -> None:
    remap(rig, 0, 0x60410010, kind=0)
    for _ in range(5):
        rig.send(0x080, b"")
    rig.control(0x06)
    assert len(rig.sent(TPDO1)) == 1
    rig.send(0x080, b"")
    rig.send(0x080, b"")
    assert [struct.unpack("<H", data)[0] & 0x6F for data in rig.sent(TPDO1)] == [0x40, 0x21]


def test_an_event_driven_pdo_comes_with_a_change_and_with_its_timer(rig: Rig) -> None:
    remap(rig, 0, 0x60410010, kind=255)
    rig.run(0.05)
    assert len(rig.sent(TPDO1)) == 1
    rig.control(0x06)
    rig.run(0.002)
    assert len(rig.sent(TPDO1)) == 2
    rig.write(0x1800, 5, 20)
    rig.frames.clear()
    rig.run(0.2)
    assert 9 <= len(rig.sent(TPDO1)) <= 11


def test_the_inhibit_time_holds_events_back() -> None:
    rig = Rig()
    rig.node.nmt.send_command(0x01)
    rig.write(0x1801, 1, rig.read(0x1801, 1) | DISABLED)
    rig.write(0x1801, 3, 500)
    remap(rig, 1, 0x60640020, kind=255)
    rig.enable(9)
    rig.write(0x60FF, 0, 100_000)
    rig.frames.clear()
    rig.run(1.0)
    assert 18 <= len(rig.sent(TPDO2)) <= 21


def test_heartbeat_and_boot_up() -> None:
    rig = Rig()
    assert rig.sent(0x700 + NODE) == [b"\0"]
    rig.write(0x1017, 0, 20)
    rig.run(0.2)
    assert set(rig.sent(0x700 + NODE)[1:]) == {b"\x7f"}
    assert 9 <= len(rig.sent(0x700 + NODE)) - 1 <= 11
    rig.node.nmt.send_command(0x01)
    rig.run(0.03)
    assert rig.sent(0x700 + NODE)[-1] == b"\x05"
    assert rig.node.nmt.state == "OPERATIONAL"


def test_a_reboot_loses_the_map_and_the_modes() -> None:
    rig = Rig()
    rig.node.nmt.send_command(0x01)
    remap(rig, 0, 0x60410010)
    rig.enable(9)
    rig.drive.inject("reboot")
    rig.frames.clear()
    rig.run(1.0)
    assert rig.sent(0x700 + NODE) == [b"\0"]
    assert rig.read(0x1A00, 0) == 3
    assert rig.read(0x6061) == 0
    assert rig.status & 0x6F == 0x40
    rig.send(0x080, b"")
    assert not rig.sent(TPDO1)


def test_a_communication_reset_keeps_the_application() -> None:
    rig = Rig()
    rig.write(0x1017, 0, 20)
    rig.write(0x6083, 0, 42_000)
    rig.node.nmt.send_command(0x82)
    rig.run(0.01)
    assert rig.read(0x1017) == 0
    assert rig.read(0x6083) == 42_000


def test_silence_is_a_cut_cable_and_heartbeat_stop_is_not() -> None:
    rig = Rig()
    rig.write(0x1017, 0, 10)
    rig.enable(9)
    rig.write(0x60FF, 0, 100_000)
    rig.watch_host(50)
    rig.drive.inject("heartbeat stop")
    rig.frames.clear()
    rig.run(0.2)
    assert not rig.sent(0x700 + NODE)
    assert rig.status & 0x6F == 0x27
    rig.drive.inject("silence")
    rig.frames.clear()
    rig.run(0.5)
    assert not rig.frames
    assert rig.shaft.motor_velocity == 0
    rig.drive.inject("recover")
    rig.run(0.1)
    assert rig.sent(0x700 + NODE)
