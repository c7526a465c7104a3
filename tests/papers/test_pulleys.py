"""Chains of pulleys in both directions, and Eq. 27 (Cable-winding device)."""

from __future__ import annotations

from math import cos, exp, pi, sin, sqrt

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.estimation import DahlEstimator, PulleyGroup
from winchkit.model.friction import normal_force, stribeck, tension_after
from winchkit.model.pulleys import Bearings, Eyelets, eq27_tension, over_pulleys
from winchkit.sim.physics.presliding import relax

WRAPS = (pi / 2, pi, pi / 3)
tensions = st.floats(1.0, 1e4)
wraps = st.floats(0.05, pi)
frictions = st.floats(-0.5, 0.5)


def presliding(
    tension: ArrayLike, wraps: tuple[float, ...], towards: Array, group: tuple[float, ...]
) -> Array:
    """Tension behind pulleys along a path, by the estimator's exact steps from zero friction."""
    estimator = DahlEstimator([PulleyGroup(wraps, *group)])
    samples = np.broadcast(tension, towards)
    return np.array([estimator.update(float(pull), -float(way)).value for pull, way in samples])


@given(tensions, wraps, frictions, st.floats(-0.3, 0.3))
def test_coulomb_with_drag_solves_its_implicit_equation(
    before: float, wrap: float, friction: float, share: float
) -> None:
    """T1 − T0 = μ N(T0, T1) + d (Eq. 20–22)."""
    drag = share * before
    after = float(tension_after(before, wrap, friction, drag))
    assume(after > 0)
    normal = float(normal_force(np.asarray(before), np.asarray(after), wrap))
    assert after - before == pytest.approx(friction * normal + drag, abs=1e-9 * before)


@given(tensions, wraps, frictions, st.floats(-0.3, 0.3))
def test_walking_back_gives_what_was_there(
    before: float, wrap: float, friction: float, share: float
) -> None:
    after = float(tension_after(before, wrap, friction, share * before))
    assume(after > 0.01 * before)
    back = float(tension_after(after, wrap, -friction, -share * before))
    assert back == pytest.approx(before, rel=1e-9)


@pytest.mark.parametrize(
    "law",
    [
        Eyelets(0.1),
        Bearings(0.03),
        Bearings(0.03, viscosity=20.0),
        Bearings(0.02, viscosity=5.0, static=0.05, stribeck_speed=0.02),
    ],
)
def test_from_cell_to_platform_and_back(law: Eyelets | Bearings) -> None:
    """The same walk in the other order, the cable running the other way along it."""
    wound_in = np.array([-0.5, -0.01, 0.0, 0.003, 0.2])
    platform = np.array([100.0, 200.0, 300.0, 400.0, 500.0])
    cell = over_pulleys(platform, WRAPS[::-1], wound_in, law)
    assert np.all(np.sign(cell - platform) == np.sign(wound_in))
    assert np.allclose(over_pulleys(cell, WRAPS, -wound_in, law), platform, rtol=1e-12)


def test_eyelets_multiply_by_the_sum_of_angles() -> None:
    found = over_pulleys(100.0, WRAPS, 1.0, Eyelets(0.07))
    assert float(found) == pytest.approx(100 * exp(0.07 * sum(WRAPS)), rel=1e-12)


def test_the_stribeck_curve_between_its_ends() -> None:
    speed = np.array([0.0, 0.02, 10.0])
    found = stribeck(speed, 0.01, 0.04, 0.02)
    assert np.allclose(found, [0.04, 0.01 + 0.03 / np.e, 0.01])


@pytest.mark.parametrize("direction", [1, -1])
def test_after_presliding_a_pulley_slides(direction: int) -> None:
    towards = direction * np.linspace(0, 0.5, 400)
    found = presliding(300.0, WRAPS, towards, (0.03, 2000.0))
    slid = over_pulleys(300.0, WRAPS, float(direction), Bearings(0.03))
    assert found[0] == 300.0
    assert found[-1] == pytest.approx(float(slid), rel=1e-9)
    assert np.all(np.diff(direction * found) >= -1e-9)


@pytest.mark.parametrize("shape", [1.0, 1.7])
def test_presliding_from_the_cell_undoes_presliding_from_the_platform(shape: float) -> None:
    """Both walks hold the same friction, up to the size of a step."""
    time = np.linspace(0, 12, 6001)
    wound_in = 0.02 * np.sin(time) + 0.004 * np.sin(5 * time)
    platform = 300 + 30 * np.cos(0.7 * time)
    group = (0.02, 1500.0, shape)
    cell = presliding(platform, WRAPS[::-1], wound_in, group)
    assert np.ptp(cell - platform) > 20
    assert np.allclose(presliding(cell, WRAPS, -wound_in, group), platform, atol=0.02)


def test_presliding_is_the_simulators_integration() -> None:
    wound_in = 0.02 * np.sin(np.linspace(0, 12, 3000))
    found = presliding(300.0, (2.0,), wound_in, (0.04, 1500.0))
    force, expected = 0.0, []
    for moved in np.diff(wound_in, prepend=wound_in[0]):
        normal = sqrt(300**2 - 2 * 300 * (300 + force) * cos(2.0) + (300 + force) ** 2)
        force = relax(force, float(moved), 0.04 * normal, 1500.0, 1.0)
        expected.append(300 + force)
    assert np.allclose(found, expected, atol=0.02)


def summed_friction(wraps: tuple[float, ...], friction: float, *, printed: bool) -> float:
    """Eq. 24's second line over T_1: friction of a chain, pulley j = 3 the first on the way."""
    n = []
    for wrap in wraps[::-1]:
        n.append(float(over_pulleys(1.0, (wrap,), 1.0, Bearings(friction))))
    total = 0.0
    for j in (1, 2, 3):
        own = n[3 - j]
        square = n[2] ** 2 if printed else own**2
        normal = sqrt(square - 2 * own * cos(wraps[j - 1]) + 1)
        total += float(np.prod(n[: 3 - j])) * friction * normal
    return total


def test_eq_24_has_the_last_pulleys_ratio_under_every_root() -> None:
    """The friction of all pulleys adds up to the loss of tension, T_4 − T_1; not as printed."""
    wraps = (pi / 2, pi, pi / 3)
    lost = float(over_pulleys(1.0, wraps[::-1], 1.0, Bearings(0.05))) - 1
    assert summed_friction(wraps, 0.05, printed=False) == pytest.approx(lost, rel=1e-12)
    assert lost == pytest.approx(0.24723, abs=5e-6)
    assert summed_friction(wraps, 0.05, printed=True) == pytest.approx(0.24749, abs=5e-6)
    # A thousandth there, a hundredth where friction is strong.
    strong = float(over_pulleys(1.0, wraps[::-1], 1.0, Bearings(0.4))) - 1
    assert summed_friction(wraps, 0.4, printed=False) == pytest.approx(strong, rel=1e-12)
    assert summed_friction(wraps, 0.4, printed=True) != pytest.approx(strong, rel=0.01)
    # Pulleys that are all alike hide it.
    alike = (pi / 2,) * 3
    assert summed_friction(alike, 0.05, printed=True) == pytest.approx(
        summed_friction(alike, 0.05, printed=False), rel=1e-12
    )


@given(
    st.floats(10, 2000),
    st.floats(-0.05, 0.05),
    st.lists(st.floats(1e-3, 0.2), min_size=1, max_size=4),
)
def test_eq_27_is_solved(platform: float, towards: float, loss: list[float]) -> None:
    stiffness, sign = 2000.0, float(np.sign(towards))

    def missing(tension: float) -> float:
        friction = sum(
            share * tension * (1 - exp(-stiffness * abs(towards) / (share * tension)))
            for share in loss
        )
        return tension + sign * friction - platform

    expected = brentq(missing, 1e-3 * platform, 10 * platform, xtol=1e-11, rtol=1e-13)
    assert float(eq27_tension(platform, towards, loss, stiffness)) == pytest.approx(
        expected, rel=1e-9
    )


def test_eq_27_solved_for_t_is_not_the_platforms_tension_put_in() -> None:
    """T is on both sides: with the platform's own tension in its place 40 N are wrong."""
    platform, loss, stiffness, towards = 1000.0, (0.07, 0.07, 0.07), 5000.0, 1.0
    solved = float(eq27_tension(platform, towards, loss, stiffness))
    put_in = platform - sum(
        share * platform * -np.expm1(-stiffness * towards / (share * platform)) for share in loss
    )
    assert solved == pytest.approx(1000 / 1.21, rel=1e-6)
    assert solved - put_in > 30


def test_eq_27_and_the_exact_step_agree_from_a_fresh_start() -> None:
    """Eq. 26 and 27 hold from zero friction in one direction; losses small, one pulley."""
    friction, stiffness = 0.01, 2000.0
    towards = np.linspace(0, 0.03, 50)
    platform = presliding(400.0, (pi / 2,), towards, (friction, stiffness))
    loss = friction * 2 * sin(pi / 4)
    found = eq27_tension(platform, towards, (loss,), stiffness)
    assert np.allclose(found, 400.0, atol=0.05)
    # After a reversal the printed form no longer holds.
    back = np.concatenate([towards, towards[::-1]])
    there = presliding(400.0, (pi / 2,), back, (friction, stiffness))
    printed = eq27_tension(there, back, (loss,), stiffness)
    assert np.max(np.abs(printed - 400.0)) > 5


@pytest.mark.parametrize("loss", [(0.6, 0.5), (0.0,), (-0.1,)])
def test_losses_without_a_solution_are_refused(loss: tuple[float, ...]) -> None:
    with pytest.raises(UsageError, match="loss factors"):
        eq27_tension(100.0, 0.1, loss, 1000.0)
