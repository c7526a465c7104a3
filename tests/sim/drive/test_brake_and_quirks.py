"""The holding brake's times, and in what drives depart from the standard."""

from __future__ import annotations

import struct
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drive_rig import COUNT, HOST, NODE, SERVO, Flywheel, Rig, with_quirks
from winchkit.schema.devices.servo import QuirkSpec
from winchkit.sim.drive.shaft import HoldingBrake

PV, CSV = 3, 9
SPEED = 200_000


def braked(release: float = 0.0, apply: float = 0.0, *, fitted: bool = True) -> Rig:
    quirks = QuirkSpec(brake_release=release, brake_apply=apply)
    return Rig(Flywheel(), brake=fitted, servo=with_quirks(quirks))


def test_the_motor_waits_until_the_brake_is_open() -> None:
    rig = braked(release=0.1)
    rig.enable(CSV)
    rig.write(0x60FF, 0, SPEED)
    rig.run(0.09)
    assert rig.shaft.motor_angle == 0
    assert rig.shaft.command.brake
    rig.run(0.05)
    assert rig.shaft.motor_velocity == pytest.approx(SPEED * COUNT)


def test_the_motor_holds_the_load_while_the_brake_closes() -> None:
    rig = braked(apply=0.1)
    rig.enable(CSV)
    rig.run(0.05)
    rig.control(0x00)
    for _ in range(20):
        rig.run(0.01)
        assert rig.shaft.motor_angle == 0
    assert rig.shaft.command.brake
    assert not rig.shaft.command.power


@pytest.mark.parametrize(("kind", "falls"), [("torque off", True), ("over-temperature", False)])
def test_only_a_cut_lets_the_load_fall_until_the_brake_holds(kind: str, falls: bool) -> None:
    rig = braked(apply=0.1)
    rig.enable(CSV)
    rig.run(0.05)
    rig.drive.inject(kind)
    rig.run(0.3)
    fallen = 0.5 * 50 * 0.1**2 if falls else 0.0
    assert rig.shaft.motor_angle == pytest.approx(-fallen, rel=0.05)
    assert rig.shaft.motor_velocity == 0


def test_without_a_brake_its_times_mean_nothing() -> None:
    rig = braked(0.1, 0.1, fitted=False)
    rig.enable(CSV)
    rig.write(0x60FF, 0, SPEED)
    rig.run(0.02)
    assert rig.shaft.motor_velocity > 0
    rig.control(0x00)
    rig.run(0.002)
    assert not rig.shaft.command.power
    assert not rig.shaft.command.brake


@given(
    st.lists(st.tuples(st.booleans(), st.floats(1e-3, 0.2)), max_size=30),
    st.floats(0.0, 0.3),
    st.floats(0.0, 0.3),
)
def test_a_brake_never_closes_on_a_motor_with_power_nor_leaves_one_alone(
    history: list[tuple[bool, float]], release: float, apply: float
) -> None:
    brake = HoldingBrake(fitted=True, release=release, apply=apply)
    on = off = 0.0
    for powered, dt in history:
        if powered:
            brake.power(dt)
            assert brake.closed == (on < release)
            on, off = on + dt, 0.0
        else:
            brake.off(dt, still=True, cut=False)
            assert brake.closed or brake.holding
            assert not (brake.closed and brake.holding)
            on, off = 0.0, off + dt


def test_a_mode_is_needed_to_enable() -> None:
    rig = Rig(servo=with_quirks(QuirkSpec(needs_mode=True)))
    rig.control(0x06, 0x07, 0x0F)
    assert rig.status & 0x6F == 0x23
    rig.write(0x6060, 0, CSV)
    rig.control(0x0F)
    assert rig.status & 0x6F == 0x27


def test_a_quick_stop_code_that_the_drive_lacks_is_refused() -> None:
    rig = Rig(servo=with_quirks(QuirkSpec(quick_stop_codes=(-1, 2, 6))))
    for code in (2, 6, -1):
        rig.write(0x605A, 0, code)
        assert rig.read(0x605A) == code
    for code in (0, 1, 5, 8):
        with pytest.raises(Exception, match="0x06090030"):
            rig.write(0x605A, 0, code)
    assert rig.read(0x605A) == -1


def test_an_ignored_quick_stop_does_nothing() -> None:
    rig = Rig(servo=with_quirks(QuirkSpec(quick_stop_codes=(-1, 2))))
    rig.write(0x605A, 0, -1)
    rig.enable(CSV)
    rig.write(0x60FF, 0, SPEED)
    rig.run(0.1)
    rig.control(0x02)
    rig.run(0.1)
    assert rig.status & 0x6F == 0x27
    assert rig.shaft.motor_velocity == pytest.approx(SPEED * COUNT)


def test_bit_10_toggles_with_every_sync_in_cyclic_modes_only() -> None:
    rig = Rig(servo=with_quirks(QuirkSpec(toggles_bit_10=True)))
    rig.node.nmt.send_command(0x01)
    for mode, toggles in ((CSV, True), (PV, False)):
        rig.enable(mode)
        rig.write(0x60FF, 0, 30_000)
        rig.run(1.0)
        rig.frames.clear()
        for _ in range(6):
            rig.send(0x080, b"")
        seen = [struct.unpack_from("<H", data)[0] >> 10 & 1 for data in rig.sent(0x180 + NODE)]
        assert len(seen) == 6
        assert all(a != b for a, b in pairwise(seen)) == toggles


def test_both_heartbeats_are_needed() -> None:
    rig = Rig(servo=with_quirks(QuirkSpec(needs_both_heartbeats=True)))
    rig.watch_host(50)
    rig.beating = None
    rig.run(0.2)
    assert rig.emergencies() == []
    rig.write(0x1017, 0, 20)
    rig.send(0x700 + HOST, b"\x05")
    rig.run(0.2)
    assert rig.emergencies() == [0x8130]


@pytest.mark.parametrize("quirk", [True, False])
def test_leaving_operational_shuts_some_drives_down(quirk: bool) -> None:
    rig = Rig(servo=with_quirks(QuirkSpec(stops_outside_operational=quirk)))
    rig.node.nmt.send_command(0x01)
    rig.enable(CSV)
    rig.write(0x60FF, 0, SPEED)
    rig.run(0.2)
    rig.node.nmt.send_command(0x80)
    rig.run(1.0)
    assert (rig.status & 0x6F == 0x21) == quirk
    assert (rig.shaft.motor_velocity == 0) == quirk


def test_ramps_may_be_times_to_3000_rpm() -> None:
    rig = Rig(servo=with_quirks(QuirkSpec(ramps_are_times=True)))
    rig.write(0x6083, 0, 1000)
    rig.enable(PV)
    rig.write(0x60FF, 0, 65536 * 50)
    rig.run(0.25)
    assert rig.read(0x606C) == pytest.approx(0.25 * 65536 * 50, rel=0.01)


def test_a_drive_without_cyclic_modes_has_none() -> None:
    rig = Rig(servo=replace(SERVO, modes=("PP", "PV", "HM", "IP")))
    assert [bit for bit in range(16) if rig.read(0x6502) >> bit & 1] == [0, 2, 5, 6]
    for mode in (4, 8, 9, 10):
        with pytest.raises(Exception, match="0x06090030"):
            rig.write(0x6060, 0, mode)
    rig.write(0x6060, 0, 7)


def test_a_slow_boot_takes_its_time() -> None:
    rig = Rig(servo=replace(SERVO, boot_time=8.0))
    rig.node.nmt.send_command(0x81)
    rig.frames.clear()
    rig.run(6.0)
    assert not rig.frames
    rig.run(1.0)
    assert rig.frames[0][1:] == (0x700 + NODE, b"\0")
