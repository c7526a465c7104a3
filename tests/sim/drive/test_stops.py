"""How the simulated drive stops: option codes, halt, lost connection; in simulated time."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drive_rig import COUNT, NODE, Flywheel, Rig
from winchkit.catalog import find
from winchkit.schema.read import read_profile
from winchkit.schema.simbench import WinchTruth
from winchkit.sim.plant.plant import WinchPlant

PV, CSP, CSV = 3, 8, 9
SLOW, QUICK, HARD = 400_000, 2_000_000, 10_000_000
SPEED = 600_000
SOD, READY, SWITCHED_ON, QUICK_STOP, FAULT = 0x40, 0x21, 0x23, 0x07, 0x08


def moving(mode: int = CSV, *, brake: bool = True, shaft: object = None) -> Rig:
    rig = Rig(shaft if shaft is not None else Flywheel(), brake=brake)
    for index, rate in ((0x6083, HARD), (0x6084, SLOW), (0x6085, QUICK), (0x60C6, HARD)):
        rig.write(index, 0, rate)
    rig.enable(mode)
    rig.write(0x60FF, 0, SPEED)
    rig.run(0.1)
    assert rig.read(0x606C) == pytest.approx(SPEED, rel=1e-3)
    return rig


def time_to_stop(rig: Rig, limit: float = 3.0) -> float:
    start = rig.now
    while abs(rig.shaft.motor_velocity) > 1e-6:
        rig.run(1e-3)
        assert rig.now - start < limit
    return rig.now - start


def state(rig: Rig) -> int:
    return rig.status & 0x6F


def settle(rig: Rig) -> int:
    rig.run(0.01)
    return state(rig)


@pytest.mark.parametrize(
    ("option", "rate", "end"),
    [
        (1, SLOW, SOD),
        (2, QUICK, SOD),
        (3, HARD, SOD),
        (4, HARD, SOD),
        (5, SLOW, QUICK_STOP),
        (6, QUICK, QUICK_STOP),
        (7, HARD, QUICK_STOP),
        (8, HARD, QUICK_STOP),
    ],
)
def test_quick_stop_follows_605a(option: int, rate: int, end: int) -> None:
    rig = moving()
    rig.write(0x605A, 0, option)
    start = rig.shaft.motor_angle
    rig.control(0x02)
    assert state(rig) == QUICK_STOP
    assert time_to_stop(rig) == pytest.approx(SPEED / rate, abs=3e-3)
    travel = (rig.shaft.motor_angle - start) / COUNT
    assert travel == pytest.approx(SPEED**2 / (2 * rate), rel=0.02, abs=SPEED * 1e-3)
    assert settle(rig) == end
    assert bool(rig.status & 0x400) == (end == QUICK_STOP)


def test_quick_stop_0_coasts_into_the_brake_or_falls() -> None:
    held = moving(brake=True)
    held.write(0x605A, 0, 0)
    held.control(0x02)
    assert state(held) == SOD
    assert time_to_stop(held) <= 2e-3
    falling = moving(brake=False)
    falling.write(0x605A, 0, 0)
    falling.control(0x02)
    falling.run(0.5)
    assert falling.shaft.motor_velocity == pytest.approx(SPEED * COUNT - 50 * 0.5, abs=0.2)


@pytest.mark.parametrize(
    ("index", "word", "end"), [(0x605B, 0x06, READY), (0x605C, 0x07, SWITCHED_ON)]
)
def test_shutdown_and_disable_follow_their_options(index: int, word: int, end: int) -> None:
    ramping = moving()
    ramping.write(index, 0, 1)
    ramping.control(word)
    assert state(ramping) == 0x27
    assert time_to_stop(ramping) == pytest.approx(SPEED / SLOW, abs=3e-3)
    assert settle(ramping) == end
    coasting = moving()
    coasting.write(index, 0, 0)
    coasting.control(word)
    assert state(coasting) == end


def test_enable_takes_a_pending_shutdown_back() -> None:
    rig = moving()
    rig.control(0x06)
    rig.run(0.2)
    rig.control(0x0F)
    rig.write(0x60FF, 0, SPEED)
    rig.run(0.5)
    assert state(rig) == 0x27
    assert rig.shaft.motor_velocity == pytest.approx(SPEED * COUNT)


@pytest.mark.parametrize(
    ("option", "rate"), [(0, None), (1, SLOW), (2, QUICK), (3, HARD), (4, HARD)]
)
def test_fault_reaction_follows_605e(option: int, rate: int | None) -> None:
    rig = moving()
    rig.write(0x605E, 0, option)
    rig.drive.inject("over-temperature")
    if rate is None:
        assert rig.status & 0x4F == FAULT
    else:
        assert rig.status & 0x4F == 0x0F
        assert time_to_stop(rig) == pytest.approx(SPEED / rate, abs=3e-3)
    rig.run(0.01)
    assert rig.status & 0x4F == FAULT
    assert rig.shaft.motor_velocity == 0


@pytest.mark.parametrize(("option", "rate"), [(1, SLOW), (2, QUICK), (3, HARD), (4, HARD)])
@pytest.mark.parametrize("mode", [PV, CSV])
def test_halt_stops_by_605d_and_its_end_goes_on(mode: int, option: int, rate: int) -> None:
    rig = moving(mode)
    rig.write(0x605D, 0, option)
    rig.control(0x10F)
    assert time_to_stop(rig) == pytest.approx(SPEED / rate, abs=3e-3)
    assert state(rig) == 0x27
    rig.run(0.1)
    assert rig.shaft.motor_velocity == 0
    rig.control(0x0F)
    rig.run(0.2)
    assert rig.shaft.motor_velocity == pytest.approx(SPEED * COUNT)


def test_disable_voltage_cuts_a_ramp_short() -> None:
    rig = moving(brake=False)
    rig.write(0x605A, 0, 1)
    rig.control(0x02)
    rig.run(0.01)
    rig.control(0x00)
    assert state(rig) == SOD
    assert not rig.shaft.command.power or settle(rig) == SOD
    rig.run(0.002)
    assert not rig.shaft.command.power


def test_a_heartbeat_watch_is_armed_by_the_first_heartbeat_only() -> None:
    rig = moving()
    rig.write(0x1016, 1, 127 << 16 | 50)
    rig.run(0.5)
    assert rig.shaft.motor_velocity != 0
    rig.watch_host(50)
    rig.run(0.5)
    assert rig.shaft.motor_velocity != 0
    assert rig.emergencies() == []
    rig.beating = None
    rig.run(0.06)
    assert rig.emergencies() == [0x8130]


@pytest.mark.parametrize(("option", "end"), [(0, 0x27), (1, FAULT), (2, SOD), (3, SOD)])
def test_a_lost_heartbeat_follows_6007(option: int, end: int) -> None:
    rig = moving()
    rig.write(0x6007, 0, option)
    rig.watch_host(100)
    rig.beating = None
    rig.run(1.0)
    assert rig.status & (0x4F if end in (FAULT, SOD) else 0x6F) == end
    assert (rig.shaft.motor_velocity != 0) == (option == 0)
    assert rig.emergencies() == [0x8130]
    assert rig.read(0x603F) == (0x8130 if option == 1 else 0)


def test_a_lost_heartbeat_leaves_operational_and_its_return_is_reported() -> None:
    rig = moving()
    rig.node.nmt.send_command(0x01)
    rig.write(0x1017, 0, 10)
    rig.watch_host(100)
    rig.beating = None
    rig.run(0.5)
    assert rig.sent(0x700 + NODE)[-1] == b"\x7f"
    rig.beating = rig.now
    rig.run(0.1)
    assert rig.emergencies() == [0x8130, 0]


def test_nmt_stop_is_a_lost_connection_too() -> None:
    rig = moving()
    rig.node.nmt.send_command(0x02)
    assert time_to_stop(rig) == pytest.approx(SPEED / QUICK, abs=3e-3)
    before = len(rig.frames)
    rig.send(0x600 + NODE, struct.pack("<BHB4x", 0x40, 0x6041, 0))
    assert len(rig.frames) == before


def test_only_the_host_that_is_named_keeps_the_drive_alive() -> None:
    rig = moving()
    rig.watch_host(50)
    rig.beating = None
    for _ in range(20):
        rig.send(0x700 + 33, b"\x05")
        rig.run(0.01)
    assert rig.emergencies() == [0x8130]


@settings(max_examples=60, deadline=None)
@given(
    st.integers(-1_500_000, 1_500_000),
    st.floats(0.0, 0.4),
    st.sampled_from([1, 3]),
    st.sampled_from([PV, CSV]),
)
def test_a_killed_master_stops_the_real_winch_in_time(
    speed: int, moment: float, option: int, mode: int
) -> None:
    """At any moment: within the heartbeat time, the ramp and the servo's lag it stands."""
    profile = read_profile(find("profiles", "bench-spiral"))
    rig = Rig(WinchPlant(profile, WinchTruth(load_mass=10.0), seed=1))
    rig.write(0x6007, 0, option)
    rig.write(0x6085, 0, QUICK)
    rig.write(0x6083, 0, HARD)
    rig.enable(mode)
    rig.watch_host(100)
    rig.write(0x60FF, 0, speed)
    rig.run(moment)
    rig.beating = None
    fastest = abs(rig.shaft.motor_velocity) if mode == PV else abs(speed) * COUNT
    fastest = max(fastest, abs(speed) * COUNT)
    start = rig.shaft.cable_length
    rig.run(0.1 + fastest / (QUICK * COUNT) + 0.15)
    assert rig.shaft.motor_velocity == pytest.approx(0.0, abs=0.06)
    assert not rig.status & 0x04 or rig.status & 0x4F == 0x08
    reach = fastest * 0.003 * (0.1 + fastest / (2 * QUICK * COUNT) + 0.15)
    assert abs(rig.shaft.cable_length - start) <= reach + 1e-3
    resting = rig.shaft.motor_angle
    rig.run(0.3)
    assert rig.shaft.motor_angle == pytest.approx(resting, abs=0.02)


def test_a_motor_that_is_dragged_along_does_not_keep_its_drive_in_the_fault_reaction() -> None:
    """A torque limit below the load's weight: the fault follows, and the brake with it."""
    profile = read_profile(find("profiles", "bench-spiral"))
    rig = Rig(WinchPlant(profile, WinchTruth(load_mass=10.0), seed=1))
    rig.enable(CSV)
    rig.write(0x6072, 0, 20)
    rig.run(0.3)
    assert rig.shaft.motor_velocity < -1.0
    rig.drive.inject("over-temperature")
    rig.run(0.7)
    assert rig.status & 0x4F == FAULT
    rig.run(2.0)
    assert rig.shaft.motor_velocity == 0
