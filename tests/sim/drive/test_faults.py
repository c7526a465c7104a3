"""Faults on request: what each sends, shows and does to the motion, and how it ends."""

from __future__ import annotations

import pytest
from canopen.sdo.exceptions import SdoAbortedError

from drive_rig import COUNT, NODE, Flywheel, Rig
from winchkit.errors import UsageError
from winchkit.sim.drive.drive import CONDITIONS, FAULTS

CSV = 9
SPEED, RATE = 400_000, 2_000_000
CODES = {
    "over-current": (0x2310, True),
    "over-voltage": (0x3210, False),
    "under-voltage": (0x3220, False),
    "over-temperature": (0x4310, False),
    "torque off": (0x5441, True),
    "encoder": (0x7305, True),
    "following error": (0x8611, False),
}
TPDO1 = 0x180 + NODE


def moving(*, brake: bool = True) -> Rig:
    rig = Rig(Flywheel(), brake=brake)
    rig.node.nmt.send_command(0x01)
    rig.write(0x6085, 0, RATE)
    rig.write(0x605E, 0, 2)
    rig.enable(CSV)
    rig.write(0x60FF, 0, SPEED)
    rig.run(0.1)
    assert rig.shaft.motor_velocity == pytest.approx(SPEED * COUNT)
    return rig


def test_the_table_is_the_whole_of_what_there_is() -> None:
    assert {name: (kind.code, kind.cuts) for name, kind in FAULTS.items()} == CODES


@pytest.mark.parametrize("kind", list(CODES))
def test_a_fault_shows_its_code_and_ends_the_motion(kind: str) -> None:
    code, cuts = CODES[kind]
    rig = moving(brake=False)
    rig.drive.inject(kind)
    assert rig.emergencies() == [code]
    assert rig.read(0x603F) == rig.read(0x1003, 1) == code
    assert rig.status & 0x4F == (0x08 if cuts else 0x0F)
    rig.run(SPEED / RATE / 2)
    if cuts:
        # Free: it loses 50 rad/s², not the ramp's 192.
        assert rig.shaft.motor_velocity == pytest.approx(SPEED * COUNT - 50 * 0.1, abs=0.2)
    else:
        assert rig.shaft.motor_velocity == pytest.approx(SPEED * COUNT / 2, abs=0.5)
    rig.run(SPEED / RATE)
    assert rig.status & 0x4F == 0x08
    assert not rig.shaft.command.power
    rig.control(0x00, 0x80)
    assert rig.status & 0x4F == 0x40
    assert rig.read(0x603F) == 0
    assert rig.emergencies() == [code, 0]


def test_a_second_fault_waits_for_the_end_of_the_first() -> None:
    rig = moving()
    rig.drive.inject("over-temperature")
    rig.drive.inject("over-voltage")
    rig.run(1.0)
    assert rig.emergencies() == [0x4310]
    assert rig.read(0x603F) == 0x4310


def test_a_lost_host_is_one_that_is_no_longer_heard() -> None:
    rig = moving()
    rig.write(0x6007, 0, 3)
    rig.watch_host(1000)
    rig.drive.inject("host lost")
    assert rig.emergencies() == [0x8130]
    rig.beating = None
    rig.run(1.0)
    assert rig.shaft.motor_velocity == 0
    assert rig.status & 0x4F == 0x40


def test_a_lost_map_leaves_the_drive_without_pdos_and_without_a_report() -> None:
    rig = moving()
    rig.send(0x080, b"")
    assert rig.sent(TPDO1)
    rig.drive.inject("map lost")
    rig.frames.clear()
    rig.send(0x080, b"")
    rig.run(0.1)
    assert rig.frames == []
    assert rig.read(0x1A00, 0) == 0
    assert rig.read(0x1800, 1) >> 31
    rig.send(0x200 + NODE, b"\x02\0\0\0\0\0")
    rig.send(0x080, b"")
    assert rig.status & 0x6F == 0x27


def test_an_open_enable_input_takes_the_torque_until_it_closes() -> None:
    rig = moving()
    rig.drive.inject("enable input open")
    assert rig.status & 0x4F == 0x40
    rig.control(0x06, 0x07, 0x0F)
    assert rig.status & 0x6F == 0x23
    rig.run(0.1)
    rig.drive.inject("recover")
    assert rig.status & 0x6F == 0x23, "it does not enable itself"
    rig.control(0x0F)
    assert rig.status & 0x6F == 0x27


def test_a_tpdo_stop_leaves_heartbeat_and_sdo() -> None:
    rig = moving()
    rig.write(0x1017, 0, 10)
    rig.drive.inject("tpdo stop")
    rig.frames.clear()
    rig.run(0.1, sync=0.01)
    assert not rig.sent(TPDO1)
    assert rig.sent(0x700 + NODE)
    assert rig.status & 0x6F == 0x27
    rig.drive.inject("recover")
    rig.send(0x080, b"")
    assert rig.sent(TPDO1)


def test_a_slow_sdo_answers_late_and_in_order() -> None:
    rig = moving()
    rig.drive.inject("slow sdo")
    rig.frames.clear()
    for index in (0x6041, 0x6061):
        rig.send(0x600 + NODE, bytes((0x40, index & 0xFF, index >> 8, 0, 0, 0, 0, 0)))
    rig.run(0.29)
    assert not rig.sent(0x580 + NODE)
    rig.run(0.02)
    answers = rig.sent(0x580 + NODE)
    assert [data[1:3] for data in answers] == [b"\x41\x60", b"\x61\x60"]
    rig.drive.inject("recover")
    assert rig.read(0x6061) == CSV


def test_an_aborting_sdo_aborts_everything_until_it_recovers() -> None:
    rig = moving()
    rig.drive.inject("sdo abort")
    for attempt in (lambda: rig.read(0x6041), lambda: rig.write(0x6040, 0, 0)):
        with pytest.raises(SdoAbortedError) as refused:
            attempt()
        assert refused.value.code == 0x08000000
    rig.drive.inject("recover")
    assert rig.status & 0x6F == 0x27


def test_a_storm_of_emergencies_does_no_harm() -> None:
    rig = moving()
    rig.drive.inject("emergency storm")
    rig.run(0.2)
    assert len(rig.emergencies()) == pytest.approx(200, abs=3)
    assert set(rig.emergencies()) == {0x8120}
    assert rig.status & 0x6F == 0x27
    assert rig.read(0x1003, 0) == 4
    rig.drive.inject("recover")
    rig.frames.clear()
    rig.run(0.1)
    assert not rig.emergencies()


@pytest.mark.parametrize("kind", [*FAULTS, *CONDITIONS])
def test_every_kind_can_be_injected_and_the_drive_lives_on(kind: str) -> None:
    rig = moving()
    rig.drive.inject(kind)
    rig.run(1.5)
    rig.drive.inject("recover")
    rig.run(0.5)
    rig.control(0x00, 0x80, 0x00)
    rig.enable(CSV)
    rig.write(0x60FF, 0, SPEED)
    rig.run(0.3)
    assert rig.shaft.motor_velocity == pytest.approx(SPEED * COUNT)


def test_an_unknown_kind_is_refused_with_a_hint() -> None:
    with pytest.raises(UsageError, match="did you mean 'slow sdo'"):
        Rig().drive.inject("slow sd")
