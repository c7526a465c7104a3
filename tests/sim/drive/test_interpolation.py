"""Interpolated position (IP), and the parts of PP's handshake that a profile's numbers meet."""

from __future__ import annotations

from math import cos, pi

import pytest

from drive_rig import COUNT, Rig

PP, IP = 1, 7
ACTIVE, REACHED, ACKNOWLEDGED = 0x1000, 0x400, 0x1000


def test_interpolation_follows_its_records_while_bit_4_asks() -> None:
    rig = Rig()
    rig.write(0x60C2, 1, 4)
    rig.enable(IP)
    rig.write(0x60C1, 1, 40_000)
    rig.run(0.1)
    assert rig.read(0x6064) == 0
    assert not rig.status & ACTIVE
    rig.write(0x60C1, 1, 0)
    rig.control(0x1F)
    assert rig.status & ACTIVE
    for cycle in range(250):
        wanted = round(50_000 * (1 - cos(2 * pi * cycle * 0.004)))
        rig.write(0x60C1, 1, wanted)
        rig.run(0.004)
        assert rig.read(0x6064) == pytest.approx(wanted, abs=1)
    rig.control(0x0F)
    assert not rig.status & ACTIVE
    there = rig.read(0x6064)
    rig.write(0x60C1, 1, there + 90_000)
    rig.run(0.1)
    assert rig.read(0x6064) == there


def test_interpolation_goes_evenly_through_its_period() -> None:
    rig = Rig()
    rig.write(0x60C2, 1, 10)
    rig.enable(IP)
    rig.control(0x1F)
    rig.write(0x60C1, 1, 10_000)
    passed = []
    for _ in range(10):
        rig.run(1e-3)
        passed.append(rig.read(0x6064))
    assert passed == pytest.approx([1000 * step for step in range(1, 11)], abs=1)


def test_interpolation_stops_at_the_software_limit_and_faults_when_it_lags() -> None:
    rig = Rig()
    rig.write(0x607D, 1, -5_000)
    rig.write(0x607D, 2, 5_000)
    rig.write(0x6065, 0, 2_000)
    rig.write(0x6066, 0, 20)
    rig.enable(IP)
    rig.control(0x1F)
    rig.write(0x60C1, 1, 9_000)
    rig.run(0.1)
    assert rig.read(0x6064) == 5_000
    assert rig.status & 0x800
    rig.shaft.stuck = True
    rig.write(0x60C1, 1, 0)
    rig.run(0.5)
    assert rig.read(0x603F) == 0x8611


def test_a_set_point_keeps_the_speed_that_it_was_taken_with() -> None:
    rig = Rig()
    rig.write(0x6083, 0, 5_000_000)
    rig.write(0x6081, 0, 100_000)
    rig.enable(PP)
    rig.set_point(200_000, 0x1F, 0x0F)
    rig.write(0x6081, 0, 300_000)
    rig.run(0.5)
    assert rig.shaft.motor_velocity == pytest.approx(100_000 * COUNT, rel=1e-6)
    rig.set_point(400_000, 0x3F, 0x0F)
    rig.run(0.3)
    assert rig.shaft.motor_velocity == pytest.approx(300_000 * COUNT, rel=1e-6)


def test_a_set_point_needs_a_new_edge() -> None:
    rig = Rig()
    rig.enable(PP)
    rig.set_point(10_000, 0x1F)
    rig.run(2.0)
    assert rig.status & ACKNOWLEDGED
    rig.set_point(50_000, 0x1F)
    rig.run(1.0)
    assert rig.read(0x6064) == 10_000
    rig.control(0x0F)
    assert not rig.status & ACKNOWLEDGED
    rig.control(0x1F)
    rig.run(2.0)
    assert rig.read(0x6064) == 50_000


def test_halt_interrupts_a_profile_and_its_end_goes_on() -> None:
    rig = Rig()
    rig.enable(PP)
    rig.set_point(500_000, 0x1F, 0x0F)
    rig.run(0.4)
    rig.control(0x10F)
    rig.run(1.0)
    assert rig.shaft.motor_velocity == 0
    assert rig.status & REACHED
    assert 0 < rig.read(0x6064) < 500_000
    rig.control(0x0F)
    rig.run(3.0)
    assert rig.read(0x6064) == 500_000
    assert rig.status & REACHED


def test_relative_moves_add_up_even_while_one_is_under_way() -> None:
    rig = Rig()
    rig.enable(PP)
    rig.set_point(50_000, 0x5F, 0x4F, 0x5F, 0x4F)
    rig.run(4.0)
    assert rig.read(0x6064) == 100_000


def test_a_profile_is_held_to_the_greatest_profile_speed() -> None:
    rig = Rig()
    rig.write(0x6081, 0, 600_000)
    rig.write(0x607F, 0, 150_000)
    rig.enable(PP)
    rig.set_point(500_000, 0x1F)
    fastest = 0.0
    for _ in range(500):
        rig.run(2e-3)
        fastest = max(fastest, rig.shaft.motor_velocity)
    assert fastest == pytest.approx(150_000 * COUNT, rel=1e-6)


def test_a_disabled_drive_takes_no_set_point() -> None:
    rig = Rig()
    rig.write(0x6060, 0, PP)
    rig.write(0x607A, 0, 50_000)
    rig.control(0x16, 0x17)
    assert not rig.status & ACKNOWLEDGED
    rig.control(0x0F)
    rig.run(1.0)
    assert rig.read(0x6064) == 0
