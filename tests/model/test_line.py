"""The line: loads, missing channels, directions, and the order of its stages."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import pi

import numpy as np
import pytest

from model_lines import line_with, profile_with, swing
from winchkit.model.derivatives import SamplingTimes, direction
from winchkit.model.line import Line
from winchkit.model.stages import ROBOT_STAGES, Modifier, Signals, Stage
from winchkit.schema.profiles.winch import ReferenceSpec
from winchkit.units import GRAVITY


def test_positive_motor_angle_winds_in_and_positive_torque_holds_the_load() -> None:
    line = Line(profile_with("grooved"))
    time = np.linspace(0, 1, 50)
    predicted = line.predict(line.motion(Signals(time, 10 * time, load=np.full_like(time, 80.0))))
    assert np.all(np.diff(predicted["cable_length"]) < 0)
    arm = np.hypot(0.06, 0.007 / (2 * pi)) / 17.3
    assert np.allclose(predicted["motor_torque"], 80.0 * arm)
    assert np.allclose(predicted["cable_length"], 8.0 - 10 * time * arm)


def test_the_reference_is_where_the_angle_and_the_length_say() -> None:
    profile = replace(
        profile_with("spiral"), reference=ReferenceSpec(12.5, cable_length=3.25, wound_turns=6.0)
    )
    assert Line(profile).cable_length(12.5) == 3.25
    assert Line(profile).motor_angle(3.25) == pytest.approx(12.5, abs=1e-9)


def test_a_hanging_mass_pulls_with_its_weight_and_its_inertia() -> None:
    line = Line(profile_with("grooved"))
    time = np.linspace(0, 10, 1001)
    arm = line.arm(0.0)
    length = 8.0 - 0.5 * np.sin(1.3 * time)
    motion = line.motion(Signals(time, 0.5 * np.sin(1.3 * time) / arm, load_mass=20.0))
    expected = 20.0 * (GRAVITY - 0.5 * 1.3**2 * np.sin(1.3 * time))
    assert np.allclose(motion.load[5:-5], expected[5:-5], atol=0.01)
    assert np.allclose(line.predict(motion)["tension"], motion.load)
    assert np.allclose(motion.at.free_length, length)


def test_a_hanging_mass_at_uneven_sampling_keeps_a_constant_acceleration() -> None:
    line = Line(profile_with("grooved"))
    time = np.sort(np.random.default_rng(5).uniform(0, 4, 400))
    motion = line.motion(Signals(time, 3.0 * time**2, load_mass=10.0))
    # Acceleration of the length: −6 rad/s² times the arm.
    inner = motion.load[5:-5]
    assert np.allclose(inner, 10.0 * (GRAVITY + 6.0 * line.arm(0.0)), rtol=1e-6)


def test_a_hanging_mass_follows_the_cable_as_it_is_really_paid_out() -> None:
    """Runout of the drum accelerates the load: its tension follows the length."""
    line = line_with(
        profile_with("grooved"), {"drum-eccentricity": {"eccentricity": 0.01, "phase": 0.3}}
    )
    time = np.linspace(0, 10, 2001)
    signals = Signals(time, 60.0 * time, load_mass=20.0)
    predicted = line.predict(line.motion(signals))
    drum_speed = 60.0 / 17.3
    shaking = 0.01 * drum_speed**2 * np.sin(drum_speed * time - 0.3)
    expected = 20.0 * (GRAVITY - shaking)
    assert np.ptp(expected) > 4
    assert np.allclose(predicted["tension"][9:-9], expected[9:-9], atol=0.01)
    arm = line.profile.drum.winding_radius
    assert np.ptp(predicted["motor_torque"]) > 0.02 * arm


def test_a_slow_motion_has_directions_and_none_at_standstill() -> None:
    line = Line(profile_with("grooved"))
    time = np.linspace(0, 20, 2001)
    at = line.motion(Signals(time, 0.02 * np.sin(time))).at
    moving = np.abs(at.motor_rate) > 0.15 * np.max(np.abs(at.motor_rate))
    assert np.allclose(at.motor_direction[moving], np.sign(at.motor_rate[moving]), atol=0.01)
    assert np.allclose(at.direction[moving], np.sign(at.speed[moving]), atol=0.01)
    still = line.motion(Signals(time, np.full_like(time, 1234.567))).at
    assert np.allclose(still.motor_direction, 0.0, atol=1e-6)
    assert np.allclose(still.direction, 0.0, atol=1e-6)


def test_the_expected_direction_is_the_mean_of_the_true_one() -> None:
    """By simulation: half of the samples stand, the others have any rate, and both have noise."""
    random = np.random.default_rng(0)
    true = np.where(random.random(400_000) < 0.5, 0.0, random.uniform(-1, 1, 400_000))
    rate = true + 0.02 * random.standard_normal(len(true))
    expected = direction(rate, 0.02, 0.5)
    for low in np.arange(-0.15, 0.15, 0.01):
        own = (rate >= low) & (rate < low + 0.01)
        assert np.mean(expected[own]) == pytest.approx(np.mean(np.sign(true[own])), abs=0.05)
    threshold = np.where(np.abs(rate) > 0.06, np.sign(rate), 0.0)
    assert np.mean((expected - np.sign(true)) ** 2) < np.mean((threshold - np.sign(true)) ** 2)


def test_a_rate_above_the_creep_rate_has_a_direction_whatever_its_noise() -> None:
    rate = np.linspace(-2, 2, 401)
    assert direction(rate, 100.0, 0.5)[np.abs(rate) > 0.5] == pytest.approx(
        np.sign(rate[np.abs(rate) > 0.5]), abs=0.01
    )


def test_a_measured_load_comes_before_a_known_mass() -> None:
    line = Line(profile_with("grooved"))
    time, angle = swing()
    motion = line.motion(Signals(time, angle, load=np.full_like(time, 55.0), load_mass=20.0))
    assert np.all(line.predict(motion)["tension"] == 55.0)


def test_without_a_load_the_cell_stands_in_and_nothing_before_it_can_be_seen() -> None:
    time, angle = swing()
    tension = 90 + 10 * np.cos(time)
    signals = Signals(time, angle, tension=tension)
    bare = Line(profile_with("archimedean"))
    plain = bare.predict(bare.motion(signals))
    assert "tension" not in plain
    arm = np.array([bare.arm(x) for x in angle[::200]])
    assert np.allclose(plain["motor_torque"][::200], tension[::200] * arm)
    blind = line_with(
        bare.profile,
        {"pulley-coulomb": {"friction": 0.1}, "cable-weight": {"mass_per_length": 0.2}},
    )
    assert np.array_equal(
        blind.predict(blind.motion(signals))["motor_torque"], plain["motor_torque"]
    )
    elastic = line_with(bare.profile, {"frame-compliance": {"stiffness": 1e4}})
    longer = elastic.predict(elastic.motion(signals))["cable_length"] - plain["cable_length"]
    assert np.allclose(longer, tension / 1e4)


def test_with_a_load_the_cell_reading_is_not_looked_at() -> None:
    time, angle = swing()
    load = np.full_like(time, 70.0)
    line = Line(profile_with("spiral"))
    with_cell = Signals(time, angle, load=load, tension=load + 30)
    alone = Signals(time, angle, load=load)
    first, second = (line.predict(line.motion(s)) for s in (with_cell, alone))
    assert all(np.array_equal(first[name], second[name]) for name in first)


def test_a_bare_drive_still_has_its_own_torque() -> None:
    time, angle = swing()
    line = line_with(profile_with("grooved"), {"rotor-inertia": {"inertia": 2.0}})
    predicted = line.predict(line.motion(Signals(time, angle)))
    assert set(predicted) == {"cable_length", "motor_torque"}
    phase = 0.4 * time
    second = 60.0 * 0.16 * (6 * np.sin(phase) * np.cos(phase) ** 2 - 3 * np.sin(phase) ** 3)
    assert np.allclose(predicted["motor_torque"][3:-3], 2.0 * second[3:-3], atol=0.02)


def test_derivatives_and_directions_are_those_of_the_motion() -> None:
    line = Line(profile_with("archimedean"))
    time, angle = swing()
    at = line.motion(Signals(time + 1e6, angle)).at
    assert at.time[0] == 0.0
    inside = slice(3, -3)
    expected = 180 * 0.4 * np.sin(0.4 * time) ** 2 * np.cos(0.4 * time)
    assert np.allclose(at.motor_rate[inside], expected[inside], atol=0.01)
    fast = np.abs(at.speed) > 0.01
    assert np.all(np.sign(at.speed[fast]) == np.sign(at.motor_rate[fast]))
    assert np.allclose(np.abs(at.direction[fast]), 1.0, atol=1e-6)
    assert np.all(np.abs(at.direction) <= 1.0)
    assert np.all(np.isnan(at.temperature))


def test_modifiers_act_in_the_order_of_stages_then_of_their_own() -> None:
    seen: list[tuple[Stage, int, int]] = []

    def noting(stage: Stage, order: int) -> Modifier:
        def apply(value: object, at: object) -> object:
            seen.append((stage, order, at.pulley))  # type: ignore[attr-defined]
            return value

        return Modifier(stage, apply, order)

    modifiers = [noting(stage, order) for stage in reversed(Stage) for order in (2, 0, 1)]
    line = Line(profile_with("grooved"), modifiers)
    time, angle = swing()
    line.predict(line.motion(Signals(time, angle, load=np.full_like(time, 1.0))))
    load = [order for stage, order, _ in seen if stage is Stage.LOAD]
    assert load == [0, 1, 2] * (len(load) // 3)
    assert seen[0][0] is Stage.LOAD, "length, tension and torque follow from it"
    seen = [item for item in seen if item[0] is not Stage.LOAD]
    stages = [stage for stage, _, _ in seen]
    assert stages == sorted(stages)
    assert {Stage.LOAD, *stages} == set(Stage) - ROBOT_STAGES
    for before, after in pairwise(seen):
        if before[0] == after[0] and before[2] == after[2]:
            assert before[1] < after[1]
    pulleys = [pulley for stage, order, pulley in seen if stage is Stage.PULLEY and order == 0]
    assert pulleys == [2, 1, 0], "from the platform to the drum"


def test_without_modifiers_tension_is_the_load_itself() -> None:
    line = Line(profile_with("spiral"))
    time, angle = swing()
    load = 50 + 10 * np.sin(time)
    assert line.predict(line.motion(Signals(time, angle, load=load)))["tension"] is load


def test_the_sharp_gradient_follows_a_ripple_and_keeps_straight_lines() -> None:
    random = np.random.default_rng(3)
    even = np.arange(200) * 0.02
    uneven = even + random.uniform(-2e-3, 2e-3, 200)
    line = 3.0 - 2.0 * uneven
    assert SamplingTimes(uneven).sharp_gradient(line) == pytest.approx(np.full(200, -2.0), abs=1e-9)
    ripple = np.sin(40.0 * even)
    found = SamplingTimes(even).sharp_gradient(ripple)[3:-3]
    assert found == pytest.approx(40.0 * np.cos(40.0 * even)[3:-3], abs=0.12)
    cubic = even**3 - even
    slope = 3 * even**2 - 1
    assert SamplingTimes(even).sharp_gradient(cubic)[3:-3] == pytest.approx(slope[3:-3], abs=1e-9)
    assert SamplingTimes(even[:5]).sharp_gradient(even[:5] ** 2)[1:-1] == pytest.approx(
        2 * even[1:4]
    )
