"""Motion of the simulated drive by mode, against closed forms."""

from __future__ import annotations

from math import cos, pi, sin, sqrt

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drive_rig import COUNT, Flywheel, Rig
from winchkit.catalog import find
from winchkit.schema.read import read_profile
from winchkit.schema.simbench import WinchTruth
from winchkit.sim.drive.cyclic_modes import MovingAverage
from winchkit.sim.plant.plant import WinchPlant

PP, PV, CSP, CSV = 1, 3, 8, 9


def winch() -> WinchPlant:
    return WinchPlant(read_profile(find("profiles", "bench-spiral")), WinchTruth(), seed=2)


def test_profile_velocity_ramps_and_says_when_it_is_there() -> None:
    rig = Rig()
    rig.write(0x6083, 0, 1_000_000)
    rig.write(0x6084, 0, 250_000)
    rig.enable(PV)
    assert rig.status & 0x1000
    rig.write(0x60FF, 0, 500_000)
    rig.run(0.25)
    assert rig.read(0x606C) == pytest.approx(250_000, rel=0.01)
    assert not rig.status & 0x400
    rig.run(0.3)
    assert rig.read(0x606C) == 500_000
    assert rig.status & 0x400
    assert not rig.status & 0x1000
    rig.write(0x60FF, 0, 0)
    rig.run(1.0)
    assert rig.read(0x606C) == pytest.approx(250_000, rel=0.01)


def test_profile_velocity_is_held_to_the_limits() -> None:
    rig = Rig()
    rig.write(0x607F, 0, 300_000)
    rig.write(0x6083, 0, 10_000_000)
    rig.enable(PV)
    rig.write(0x60FF, 0, 500_000)
    rig.run(0.5)
    assert rig.read(0x606C) == 300_000
    assert rig.status & 0x800
    rig.write(0x607F, 0, 4_000_000)
    rig.write(0x6080, 0, 60)
    rig.run(0.5)
    assert rig.read(0x606C) == pytest.approx(65_536, abs=1)


@pytest.mark.parametrize("mode", [PV, CSV])
def test_speed_ends_at_the_software_limit(mode: int) -> None:
    rig = Rig()
    rig.write(0x607D, 1, -100_000)
    rig.write(0x607D, 2, 200_000)
    rig.write(0x6083, 0, 5_000_000)
    rig.write(0x6084, 0, 1_000_000)
    rig.write(0x60C6, 0, 1_000_000)
    rig.enable(mode)
    rig.write(0x60FF, 0, 400_000)
    rig.run(3.0)
    assert 199_000 <= rig.read(0x6064) <= 200_000 + 400
    assert rig.status & 0x800
    rig.write(0x60FF, 0, -400_000)
    rig.run(3.0)
    assert -100_400 <= rig.read(0x6064) <= -99_000


def test_cyclic_velocity_goes_to_each_target_within_the_interpolation_period() -> None:
    rig = Rig()
    rig.write(0x60C2, 1, 10)
    rig.enable(CSV)
    rig.write(0x60FF, 0, 100_000)
    rig.run(0.005)
    assert rig.read(0x606C) == pytest.approx(50_000, rel=0.01)
    rig.run(0.005)
    assert rig.read(0x606C) == 100_000
    rig.run(0.1)
    assert rig.read(0x606C) == 100_000
    assert rig.status & 0x1000
    rig.write(0x60B1, 0, 5_000)
    rig.run(0.02)
    assert rig.read(0x606C) == 105_000


def test_cyclic_position_follows_a_sine_without_steps() -> None:
    rig = Rig(winch())
    rig.write(0x60C2, 1, 4)
    start = rig.read(0x6064)
    rig.write(0x607A, 0, start)
    rig.enable(CSP)
    rig.run(0.01)
    amplitude, rate, worst = 200_000, 2 * pi * 0.5, 0.0
    for cycle in range(500):
        phase = rate * cycle * 0.004
        rig.write(0x607A, 0, start + round(amplitude * (1 - cos(phase))))
        rig.run(0.004)
        wanted = amplitude * rate * sin(phase) * COUNT
        if cycle > 20:
            worst = max(worst, abs(rig.shaft.motor_velocity - wanted))
    # Lag of the servo's two filters (8 ms) and one cycle, at the acceleration of the sine.
    assert worst < amplitude * rate**2 * COUNT * 0.016
    assert abs(rig.read(0x60F4)) < 0.03 * amplitude


def test_cyclic_position_stays_within_the_software_limit() -> None:
    rig = Rig()
    rig.write(0x607D, 1, -1_000)
    rig.write(0x607D, 2, 1_000)
    rig.enable(CSP)
    rig.write(0x607A, 0, 5_000)
    rig.run(0.1)
    assert rig.read(0x6064) == 1_000
    assert rig.status & 0x800


@settings(max_examples=20, deadline=None)
@given(
    st.integers(-600_000, 600_000).filter(lambda counts: abs(counts) > 2_000),
    st.integers(150_000, 1_500_000),
    st.integers(300_000, 5_000_000),
    st.integers(300_000, 5_000_000),
)
def test_profile_position_takes_the_time_of_a_trapezoid(
    distance: int, speed: int, up: int, down: int
) -> None:
    rig = Rig()
    for index, value in ((0x6081, speed), (0x6083, up), (0x6084, down), (0x607A, distance)):
        rig.write(index, 0, value)
    rig.write(0x6067, 0, 20)
    rig.enable(PP)
    rig.control(0x1F)
    assert rig.status & 0x1000
    rig.control(0x0F)
    assert not rig.status & 0x1000
    top = min(speed, sqrt(2 * abs(distance) * up * down / (up + down)))
    ramps = 0.5 * top**2 * (1 / up + 1 / down)
    expected = top / up + top / down + (abs(distance) - ramps) / top
    start = rig.now
    fastest = 0.0
    while not rig.status & 0x400:
        rig.run(1e-3)
        fastest = max(fastest, abs(rig.shaft.motor_velocity) / COUNT)
        assert rig.now - start < expected + 0.2
    assert rig.now - start == pytest.approx(expected, abs=0.012 + 0.01 * expected)
    assert fastest <= speed * 1.001
    assert rig.read(0x6064) == pytest.approx(distance, abs=1)
    rig.run(0.2)
    assert rig.shaft.motor_velocity == 0


def test_profile_position_keeps_one_set_point_in_reserve() -> None:
    rig = Rig()
    rig.enable(PP)
    for target in (100_000, 200_000):
        rig.set_point(target, 0x1F)
        assert rig.status & 0x1000
        rig.control(0x0F)
    assert rig.status & 0x1000, "the reserve is full"
    rig.set_point(900_000, 0x1F, 0x0F)
    rig.run(3.0)
    assert rig.read(0x6064) == 200_000


def test_profile_position_at_once_and_relative() -> None:
    rig = Rig()
    rig.enable(PP)
    rig.set_point(400_000, 0x1F, 0x0F)
    rig.run(0.3)
    rig.set_point(-50_000, 0x3F, 0x0F)
    rig.run(3.0)
    assert rig.read(0x6064) == -50_000
    rig.set_point(30_000, 0x5F, 0x0F)
    rig.run(3.0)
    assert rig.read(0x6064) == -20_000


def test_a_stuck_motor_is_a_following_error_in_position_modes() -> None:
    rig = Rig()
    rig.write(0x6065, 0, 10_000)
    rig.write(0x6066, 0, 50)
    rig.enable(PP)
    rig.shaft.stuck = True
    rig.write(0x6081, 0, 500_000)
    rig.set_point(1_000_000, 0x1F)
    start = rig.now
    while rig.drive.error_code == 0:
        rig.run(1e-3)
        assert rig.now - start < 2.0
    rig.run(0.2)
    assert rig.read(0x603F) == 0x8611
    assert rig.status & 0x4F == 0x08
    assert rig.emergencies() == [0x8611]


def test_torque_limit_holds_the_load_back() -> None:
    """Below what the load needs, 6072h lets it sink although the drive is enabled."""
    rig = Rig(winch())
    rig.enable(CSV)
    rig.run(0.05)
    needed = rig.read(0x6077)
    assert needed > 0
    rig.write(0x6072, 0, needed // 2)
    rig.run(0.3)
    assert rig.shaft.motor_velocity < -0.5
    assert rig.read(0x6077) <= needed


def test_a_mode_is_shown_at_6061_and_unknown_ones_are_not_taken() -> None:
    rig = Rig()
    for mode in (PP, PV, 4, 6, 7, CSP, CSV, 10, 0):
        rig.write(0x6060, 0, mode)
        assert rig.read(0x6061) == mode
    supported = rig.read(0x6502)
    assert [bit for bit in range(16) if supported >> bit & 1] == [0, 2, 3, 5, 6, 7, 8, 9]


def test_enabling_begins_where_the_motor_is() -> None:
    rig = Rig(Flywheel(motor_angle=3.0))
    rig.write(0x607A, 0, round(3.0 / COUNT))
    rig.enable(CSP)
    rig.run(0.1)
    assert rig.shaft.motor_angle == pytest.approx(3.0, abs=COUNT)


@given(
    st.just(0.0) | st.floats(1e-6, 0.05),
    st.lists(st.tuples(st.floats(-50.0, 50.0), st.floats(1e-4, 2e-3)), min_size=1, max_size=80),
)
def test_the_set_point_filter_is_the_mean_over_its_duration(
    duration: float, signal: list[tuple[float, float]]
) -> None:
    filtered = MovingAverage(duration)
    filtered.begin(7.0)
    for value, dt in signal:
        mean = filtered.step(value, dt)
    left, total = duration, 0.0
    for value, dt in reversed(signal):
        part = min(left, dt)
        total += part * value
        left -= part
    expected = signal[-1][0] if duration == 0 else (total + left * 7.0) / duration
    assert mean == pytest.approx(expected, abs=1e-6 / max(duration, 1e-3))


def test_the_set_point_filter_delays_a_ramp_by_half_its_length() -> None:
    speeds = []
    for smoothing in (0.0, 0.04):
        rig = Rig(smoothing=smoothing)
        rig.enable(CSV)
        for cycle in range(50):
            rig.write(0x60FF, 0, 2_000 * cycle)
            rig.run(0.004)
        speeds.append(rig.read(0x606C))
    assert speeds[0] - speeds[1] == pytest.approx(500_000 * 0.02, rel=0.05)
