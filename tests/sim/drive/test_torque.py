"""Torque modes and torque limits of the simulated drive, against Newton and the load's weight."""

from __future__ import annotations

from math import pi

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drive_rig import Flywheel, Rig
from winchkit.catalog import find
from winchkit.schema.read import read_profile
from winchkit.schema.simbench import WinchTruth
from winchkit.sim.plant.plant import WinchPlant
from winchkit.sim.plant.servo import DriveCommand, Servo

PT, CSV, CST = 4, 9, 10
RATED = 2.0
"""N m, of the generic drive's 6076h."""


def winch(load_mass: float = 10.0) -> WinchPlant:
    profile = read_profile(find("profiles", "bench-spiral"))
    return WinchPlant(profile, WinchTruth(load_mass=load_mass), seed=2)


def held(mode: int, plant: WinchPlant | None = None) -> tuple[Rig, float]:
    """A winch that holds its load by torque alone, and the torque that it takes (N m)."""
    rig = Rig(winch() if plant is None else plant)
    rig.enable(CSV)
    rig.run(0.1)
    needed = rig.shaft.motor_torque
    assert needed > 0
    rig.write(0x6087, 0, 0)
    rig.write(0x6071, 0, round(needed / RATED * 1000))
    rig.write(0x6060, 0, mode)
    return rig, needed


@pytest.mark.parametrize("mode", [PT, CST])
def test_the_torque_of_the_weight_holds_and_more_lifts(mode: int) -> None:
    rig, needed = held(mode)
    rig.run(0.2)
    # Half a per mille of the rated torque is what the rounding leaves over.
    assert abs(rig.shaft.motor_velocity) < 5.0
    assert rig.shaft.motor_torque == pytest.approx(needed, abs=0.002)
    before = rig.shaft.motor_velocity
    rig.write(0x6071, 0, round((needed + 0.1) / RATED * 1000))
    rig.run(0.1)
    assert rig.shaft.motor_velocity > before + 1.0
    assert rig.read(0x6077) == pytest.approx((needed + 0.1) / RATED * 1000, abs=2)
    assert rig.read(0x6074) == round((needed + 0.1) / RATED * 1000)


@given(
    st.floats(-3.0, 3.0),
    st.floats(-1.0, 1.0),
    st.floats(1e-4, 1e-2),
    st.floats(-90.0, 90.0),
    st.floats(1e-4, 1e-3),
)
def test_a_commanded_torque_accelerates_as_newton_says(
    torque: float, idle: float, inertia: float, speed: float, dt: float
) -> None:
    """Below the top speed; a speed beyond it is brought back within the torque there is."""
    top = 100.0
    acceleration = Servo().acceleration(
        DriveCommand(torque=torque, torque_limit=2.0, negative_limit=1.0, top_speed=top),
        angle=0.0,
        speed=speed,
        idle_torque=idle,
        inertia=inertia,
        dt=dt,
    )
    made = idle + inertia * acceleration
    assert -1.0 - 1e-9 <= made <= 2.0 + 1e-9
    free = (min(max(torque, -1.0), 2.0) - idle) / inertia
    if abs(speed + free * dt) <= top:
        assert acceleration == pytest.approx(free, rel=1e-9, abs=1e-6)
    elif abs(speed) <= top:
        assert abs(speed + acceleration * dt) <= abs(speed + free * dt) + 1e-9


def test_profile_torque_takes_its_slope_and_says_when_it_is_there() -> None:
    rig, needed = held(PT)
    target = round(needed / RATED * 1000)
    rig.run(0.01)
    assert rig.status & 0x400
    rig.write(0x6087, 0, 1000)
    rig.write(0x6071, 0, target + 50)
    rig.run(0.02)
    assert not rig.status & 0x400
    assert rig.read(0x6074) == pytest.approx(target + 20, abs=2)
    rig.run(0.04)
    assert rig.read(0x6074) == target + 50
    assert rig.status & 0x400


def test_cyclic_torque_adds_its_offset_and_follows() -> None:
    rig, needed = held(CST)
    rig.write(0x60B2, 0, 30)
    rig.run(0.005)
    assert rig.read(0x6074) == round(needed / RATED * 1000) + 30
    assert rig.status & 0x1000


@pytest.mark.parametrize("mode", [PT, CST])
def test_a_torque_does_not_run_beyond_the_motor_s_speed(mode: int) -> None:
    rig, _ = held(mode)
    rig.write(0x6080, 0, 600)
    rig.write(0x6071, 0, 1000)
    rig.run(0.5)
    assert rig.shaft.motor_velocity == pytest.approx(600 * 2 * pi / 60, rel=0.02)
    rig.write(0x6071, 0, -1000)
    rig.run(0.5)
    assert rig.shaft.motor_velocity == pytest.approx(-600 * 2 * pi / 60, rel=0.02)


@pytest.mark.parametrize("mode", [PT, CST])
def test_halt_stops_a_torque_mode_and_holds_the_load(mode: int) -> None:
    rig, needed = held(mode)
    rig.write(0x6071, 0, round((needed + 0.3) / RATED * 1000))
    rig.run(0.1)
    assert rig.shaft.motor_velocity > 2.0
    rig.control(0x10F)
    rig.run(1.0)
    assert abs(rig.shaft.motor_velocity) < 0.05
    assert rig.status & 0x6F == 0x27


@pytest.mark.parametrize(
    ("index", "limited"), [(0x6072, True), (0x6073, True), (0x60E0, True), (0x60E1, False)]
)
def test_torque_and_current_limits_hold_a_lift_back(index: int, limited: bool) -> None:
    """The load pulls out; only limits of positive torque can let it sink."""
    rig = Rig(winch())
    rig.enable(CSV)
    rig.run(0.1)
    needed = rig.read(0x6077)
    rig.write(index, 0, needed // 2)
    rig.run(0.3)
    assert (rig.shaft.motor_velocity < -0.5) == limited
    assert rig.read(0x6077) <= (needed // 2 if limited else needed) + 1
    if limited:
        assert rig.read(0x6078) == rig.read(0x6077)


def test_each_sign_of_torque_has_its_own_limit() -> None:
    """A cable cannot push, so a winch's load never asks for negative torque: ask the command."""
    rig = Rig(Flywheel())
    rig.write(0x60E0, 0, 400)
    rig.write(0x60E1, 0, 50)
    rig.enable(CSV)
    rig.run(0.002)
    assert rig.shaft.command.torque_band == pytest.approx((-0.05 * RATED, 0.4 * RATED))
    rig.write(0x6072, 0, 100)
    rig.run(0.002)
    assert rig.shaft.command.torque_band == pytest.approx((-0.05 * RATED, 0.1 * RATED))


def test_a_torque_demand_beyond_the_limit_is_reported() -> None:
    rig, needed = held(CST)
    rig.write(0x6072, 0, round(needed / RATED * 1000) + 10)
    rig.run(0.01)
    assert not rig.status & 0x800
    rig.write(0x6071, 0, round(needed / RATED * 1000) + 100)
    rig.run(0.01)
    assert rig.status & 0x800


@settings(max_examples=15, deadline=None)
@given(st.sampled_from([PT, CST]), st.integers(-400, 800), st.floats(0.01, 0.2))
def test_a_lost_host_stops_a_torque_mode_too(mode: int, permille: int, moment: float) -> None:
    rig, _ = held(mode)
    rig.write(0x6085, 0, 2_000_000)
    rig.watch_host(50)
    rig.write(0x6071, 0, permille)
    rig.run(moment)
    rig.beating = None
    fastest = 4000 * 2 * pi / 60
    rig.run(0.05 + fastest / (2_000_000 * 2 * pi / 65536) + 0.6)
    assert abs(rig.shaft.motor_velocity) < 0.06
    assert rig.status & 0x6F != 0x27


def test_a_flywheel_knows_nothing_of_torque_modes() -> None:
    """A torque mode commands a torque, not a speed."""
    rig = Rig(Flywheel())
    rig.enable(CST)
    rig.write(0x6071, 0, 250)
    rig.run(0.002)
    assert rig.shaft.command.torque == pytest.approx(0.25 * RATED)
    assert rig.shaft.command.speed == 0
