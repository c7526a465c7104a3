"""Every erratum of the winding-device paper: the printed form fails, the corrected one holds."""

from __future__ import annotations

from math import cos, exp, hypot, pi, sin, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from winchkit.model.drum import Grooved
from winchkit.model.friction import dahl_step, normal_force
from winchkit.model.gearbox import worm_stage
from winchkit.model.sizing import parts

angles = st.floats(-1.5, 1.5)
RPM = pi / 30


def rotation(alpha: float, beta: float, gamma: float) -> np.ndarray:
    """Rz(α) Ry(β) Rx(γ), each by itself."""
    rz = [[cos(alpha), -sin(alpha), 0], [sin(alpha), cos(alpha), 0], [0, 0, 1]]
    ry = [[cos(beta), 0, sin(beta)], [0, 1, 0], [-sin(beta), 0, cos(beta)]]
    rx = [[1, 0, 0], [0, cos(gamma), -sin(gamma)], [0, sin(gamma), cos(gamma)]]
    return np.array(rz) @ np.array(ry) @ np.array(rx)


def printed_rotation(alpha: float, beta: float, gamma: float) -> np.ndarray:
    ca, sa, cb, sb, cg, sg = (f(x) for x in (alpha, beta, gamma) for f in (cos, sin))
    return np.array(
        [
            [ca * cb, ca * cb * sg - sa * cg, ca * sb * cg + sa * sg],
            [sa * cb, sa * cb * sg - ca * cg, sa * sb * cg + ca * sg],
            [-sb, cb * sg, cb * cg],
        ]
    )


def corrected_rotation(alpha: float, beta: float, gamma: float) -> np.ndarray:
    ca, sa, _, sb, cg, sg = (f(x) for x in (alpha, beta, gamma) for f in (cos, sin))
    fixed = printed_rotation(alpha, beta, gamma)
    fixed[0, 1] = ca * sb * sg - sa * cg
    fixed[1, 1] = sa * sb * sg + ca * cg
    fixed[1, 2] = sa * sb * cg - ca * sg
    return fixed


def test_eq_2_is_the_norm_not_its_square() -> None:
    rope = np.array([3.0, 0.0, 4.0])
    printed_length = float(np.linalg.norm(rope) ** 2)
    assert printed_length == pytest.approx(25.0)
    assert np.linalg.norm(rope / printed_length) != pytest.approx(1.0)
    assert np.linalg.norm(rope) == pytest.approx(5.0)
    assert np.linalg.norm(rope / np.linalg.norm(rope)) == pytest.approx(1.0)


@given(angles, angles, angles)
def test_eq_3_is_a_rotation_once_three_entries_are_put_right(a: float, b: float, g: float) -> None:
    fixed = corrected_rotation(a, b, g)
    assert np.allclose(fixed, rotation(a, b, g), atol=1e-12)
    wrong = np.abs(printed_rotation(a, b, g) - fixed) > 1e-12
    assert not wrong[[0, 0, 1, 2, 2, 2], [0, 2, 0, 0, 1, 2]].any()


def test_eq_3_as_printed_is_no_rotation() -> None:
    printed = printed_rotation(0.0, 0.0, 0.0)
    assert np.linalg.det(printed) == pytest.approx(-1.0)
    assert np.linalg.det(printed_rotation(0.3, 0.2, 0.4)) < 0
    assert not np.allclose(
        printed_rotation(0.3, 0.2, 0.4).T @ printed_rotation(0.3, 0.2, 0.4), np.eye(3)
    )


def test_eq_8_needs_the_transpose() -> None:
    """W = −Aᵀ (Eq. 7) and W τ + w = 0 (Eq. 4): A is m × 6, so that A τ does not even exist."""
    rng = np.random.default_rng(0)
    jacobian = rng.normal(0, 1, (8, 6))
    tension = rng.uniform(1, 2, 8)
    wrench = jacobian.T @ tension
    with pytest.raises(ValueError, match="mismatch"):
        jacobian @ tension
    assert np.allclose(-jacobian.T @ tension + wrench, 0, atol=1e-12)


def test_eq_9_has_a_derivative_too_many() -> None:
    """ξ is a velocity (Eq. 6): a platform that accelerates evenly needs m a, ξ̈ says nothing."""
    mass, rate, step = 40.0, 0.5, 1e-3
    twist = rate * np.arange(5) * step
    once, twice = np.diff(twist) / step, np.diff(twist, 2) / step**2
    assert mass * once == pytest.approx(np.full(4, mass * rate))
    assert mass * twice == pytest.approx(np.zeros(3), abs=1e-6)


def test_eq_10_gives_the_papers_efficiency_with_six_bearings() -> None:
    printed = parts.transmission_efficiency(0.8, 0.95, 2, 0.99, 2)
    assert printed == pytest.approx(0.7076, abs=5e-5)
    assert printed != pytest.approx(0.68, abs=5e-3)
    assert parts.transmission_efficiency(0.8, 0.95, 2, 0.99, 6) == pytest.approx(0.68, abs=5e-4)


def test_eq_11_needs_74_watts_not_80() -> None:
    assert parts.motor_power(1000, 0.05, 0.68) == pytest.approx(73.5, abs=0.05)
    assert parts.motor_power(1000, 0.05, 0.625) == pytest.approx(80.0)


def test_eq_12_gives_the_papers_width_only_roughly() -> None:
    widths = [parts.drum_turns(20, 0.05 + rope) * 0.005 for rope in (0.0025, 0.0)]
    assert widths == pytest.approx([0.3032, 0.3183], abs=5e-5)
    assert all(width > 0.3 for width in widths)
    # The groove is a helix: a little fewer turns, and the drum's own law counts the same.
    turns = parts.drum_turns(20, 0.05, 0.005)
    assert turns < parts.drum_turns(20, 0.05)
    assert float(Grooved(0.05, 0.005).wound(np.asarray(2 * pi * turns))) == pytest.approx(20)


def test_eq_13_speed_needs_the_whole_circumference() -> None:
    found = parts.motor_speed(0.05, 0.05, 30) / RPM
    assert found == pytest.approx(286.5, abs=0.05)
    printed = 0.05 * 30 / (pi * 0.05) * 60
    assert printed == pytest.approx(2 * found)
    # Turning at that speed the cable runs at 0.05 m/s.
    assert found / 60 / 30 * 2 * pi * 0.05 == pytest.approx(0.05)


def test_eq_13_fails_the_papers_own_gearbox() -> None:
    rated = 400 / (3000 * RPM)
    assert rated == pytest.approx(1.27, abs=5e-3)
    assert parts.motor_torque(1000, 0.05, 30, 0.68) == pytest.approx(2.45, abs=5e-3)
    assert parts.motor_torque(1000, 0.05, 57, 0.68) > rated
    assert parts.motor_torque(1000, 0.05, 58, 0.68) <= rated


def test_eq_14_has_teeth_over_threads() -> None:
    stage = worm_stage(starts=1, teeth=30, lead_angle=0.08, friction=0.05)
    printed = 1 / 30  # z2/z1 with z1 the wheel's teeth and z2 the threads, as the text says
    assert stage.ratio == 30
    assert stage.ratio == pytest.approx(1 / printed)


def test_eq_16_is_a_diameter_with_the_length_squared() -> None:
    length, speed = 730.0, 3600.0
    printed = speed * length / 21.9 * 1e-7
    assert printed == pytest.approx(0.012, abs=5e-4)
    corrected = speed * length**2 / 21.9 * 1e-7
    assert corrected == pytest.approx(8.76, abs=5e-3)
    found = parts.screw_diameter(speed * RPM, length / 1e3, "fixed-fixed")
    assert found == pytest.approx(corrected / 1e3, rel=1e-3)
    assert parts.critical_speed(0.020, length / 1e3, "fixed-fixed") > speed * RPM


@pytest.mark.parametrize(
    ("ends", "factor", "frequency"),
    [
        ("supported-supported", 9.7, sin),
        ("fixed-supported", 15.1, lambda x: sin(x) / cos(x) - np.tanh(x)),
        ("fixed-fixed", 21.9, lambda x: cos(x) * np.cosh(x) - 1),
        ("fixed-free", 3.4, lambda x: cos(x) * np.cosh(x) + 1),
    ],
)
def test_screw_factors_follow_from_the_bending_of_a_shaft(
    ends: str, factor: float, frequency: object
) -> None:
    """Makers' f of n = f d/L² · 10⁷ (rpm, mm), 0.8 of the first critical speed."""
    root = parts.BUCKLES[ends]
    assert brentq(frequency, root - 0.1, root + 0.1) == pytest.approx(root, abs=1e-5)
    found = parts.critical_speed(0.020, 0.730, ends) / RPM * 730**2 / 20 * 1e-7
    assert found == pytest.approx(factor, abs=0.05)


def test_eq_17_needs_a_module_of_7_for_the_motors_power() -> None:
    drum_speed = 0.05 / 0.05
    assert drum_speed / RPM == pytest.approx(9.55, abs=5e-3)
    assert parts.belt_module(80, drum_speed) == pytest.approx(
        35e-3 * (0.08 / 9.549) ** (1 / 3), rel=1e-4
    )
    assert parts.belt_module(80, drum_speed) == pytest.approx(7.1e-3, abs=2e-5)
    assert parts.belt_module(0.75, drum_speed) < 1.5e-3 < parts.belt_module(1.0, drum_speed)


def printed_distance(length: float, first: float, second: float) -> float:
    total = first + second
    return (length - pi * total + sqrt(length**2 - pi * total**2 - 8 * total**2)) / 4


def test_eq_18_has_its_squares_in_the_wrong_places() -> None:
    length = parts.belt_length(0.1, 0.01, 0.02)
    assert printed_distance(length, 0.01, 0.02) == pytest.approx(0.1197, abs=5e-5)
    assert parts.centre_distance(length, 0.01, 0.02) == pytest.approx(0.1, abs=1e-6)


@given(st.floats(0.01, 0.04), st.floats(0.01, 0.04), st.floats(0.09, 0.5))
def test_eq_18_corrected_is_the_exact_belt_to_second_order(
    first: float, second: float, distance: float
) -> None:
    found = parts.centre_distance(parts.belt_length(distance, first, second), first, second)
    lean = abs(second - first) / distance
    assert found == pytest.approx(distance, rel=lean**4 + 1e-12)


def test_a_belt_is_as_long_as_its_straight_and_round_parts() -> None:
    """Integrated around the outline: two tangents and two arcs."""
    first, second, distance = 0.015, 0.03, 0.12
    straight = sqrt(distance**2 - (second - first) ** 2)
    lean = np.arcsin((second - first) / distance)
    expected = 2 * straight + first * (pi - 2 * lean) + second * (pi + 2 * lean)
    assert parts.belt_length(distance, first, second) == pytest.approx(expected, rel=1e-12)


@given(st.floats(1, 1e3), st.floats(1, 1e3), st.floats(0, pi))
def test_eq_22_is_right_with_alpha_the_wrap_angle(before: float, after: float, wrap: float) -> None:
    """The cable pulls along −x where it comes and turns by the wrap: add the two vectors."""
    pull = np.array([-before, 0.0]) + after * np.array([cos(wrap), sin(wrap)])
    found = float(normal_force(np.asarray(before), np.asarray(after), wrap))
    assert found == pytest.approx(hypot(*pull), abs=1e-6)


def test_eq_25_as_printed_has_no_value_beyond_the_limit() -> None:
    """Without |.| and sign a force above a limit that fell gives no real rate for general β."""
    limit, force, shape = 10.0, 12.0, 1.5
    printed = complex(1 - force / limit) ** shape
    assert abs(printed.imag) > 0.05
    relaxed = dahl_step(force, 0.002, limit, 2000.0, shape)
    assert limit < relaxed < force

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        left = 1 - y / limit
        return 2000.0 * np.abs(left) ** shape * np.sign(left)

    solved = solve_ivp(rate, (0, 0.002), [force], rtol=1e-11, atol=1e-11)
    assert relaxed == pytest.approx(solved.y[0, -1], abs=1e-8)


def test_eq_25_as_printed_with_an_even_shape_runs_away() -> None:
    """β = 2: (1 − F/F_c)² stays positive above the limit, and friction grows without end."""
    limit, force, travel = 10.0, 10.5, 0.0
    while force < 100 and travel < 0.02:
        force += 1e-5 * 20_000.0 * (1 - force / limit) ** 2
        travel += 1e-5
    assert force >= 100
    # With absolute value and sign it comes back: 1/|u| grows from 20 by σx/F_c = 60.
    back = dahl_step(10.5, 0.03, limit, 20_000.0, 2.0)
    assert back == pytest.approx(limit * (1 + 1 / 80), rel=1e-12)


def test_eq_26_holds_only_from_zero_in_one_direction() -> None:
    limit, stiffness = 20.0, 3000.0

    def printed(x: float, direction: float) -> float:
        return limit * (1 - exp(-stiffness * abs(x) / limit)) * direction

    out = dahl_step(0.0, 0.008, limit, stiffness, 1.0)
    assert out == pytest.approx(printed(0.008, 1), rel=1e-12)
    back = dahl_step(out, -0.002, limit, stiffness, 1.0)

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        return stiffness * (1 + y / limit)

    solved = solve_ivp(rate, (0, -0.002), [out], rtol=1e-11, atol=1e-11)
    assert back == pytest.approx(solved.y[0, -1], abs=1e-8)
    # As printed, from x = 6 mm of way left or from the 2 mm since the reversal.
    assert abs(printed(0.006, -1) - back) > 10
    assert abs(printed(0.002, -1) - back) > 5
