"""Friction of the pulleys against closed forms and an ODE solver."""

from math import cos, pi, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from plant_benches import GROOVED, cruise, hide, plant
from winchkit.sim.physics.presliding import relax

LIMIT, SLOPE = 6.0, 2000.0


def by_solver(force: float, travel: float, shape: float) -> float:
    sign = np.sign(travel)

    def rate(_: float, y: np.ndarray) -> list[float]:
        load = 1 - sign * y[0] / LIMIT
        return [sign * SLOPE * abs(load) ** shape * np.sign(load)]

    found = solve_ivp(rate, (0, abs(travel)), [force], rtol=1e-9, atol=1e-10, max_step=1e-4)
    return float(found.y[0, -1])


@settings(max_examples=25, deadline=None)
@given(
    st.floats(0.5, 3.0),
    st.lists(st.floats(-0.006, 0.006).filter(lambda x: abs(x) > 1e-6), min_size=1, max_size=3),
)
def test_dahl_agrees_with_a_solver(shape: float, travels: list[float]) -> None:
    force = expected = 0.0
    for travel in travels:
        force = relax(force, travel, LIMIT, SLOPE, shape)
        expected = by_solver(expected, travel, shape)
    # A shape below 1 reaches the sliding force in finite travel, where the law has a corner.
    assert force == pytest.approx(expected, abs=2e-3 if shape < 1 else 2e-4)


@given(st.floats(-5, 5), st.floats(-0.01, 0.01), st.floats(1.0, 3.0))
def test_dahl_does_not_depend_on_the_number_of_steps(
    start: float, travel: float, shape: float
) -> None:
    once = relax(start, travel, LIMIT, SLOPE, shape)
    often = start
    for _ in range(7):
        often = relax(often, travel / 7, LIMIT, SLOPE, shape)
    assert once == pytest.approx(often, abs=1e-4)


@given(st.floats(-6, 6), st.floats(-1, 1), st.floats(0.5, 3.0))
def test_dahl_never_exceeds_its_limit(start: float, travel: float, shape: float) -> None:
    assert abs(relax(start, travel, LIMIT, SLOPE, shape)) <= LIMIT * (1 + 1e-9)


def sliding(friction: float, wraps: list[float], load: float, sign: int) -> float:
    """Drum-side tension of dry pulleys, from the quadratic that Eq. 22 and 23 make."""
    tension = load
    for wrap in reversed(wraps):
        # (x - 1)² = μ² (1 - 2 x cos α + x²), the root on the side of the direction
        a = 1 - friction**2
        b = -2 * (1 - friction**2 * cos(wrap))
        root = sqrt(b * b - 4 * a * a)
        tension *= (-b + sign * root) / (2 * a)
    return tension


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("friction", [0.01, 0.05])
def test_dry_pulleys_at_speed(sign: int, friction: float) -> None:
    winch = plant(GROOVED, hide("sticky pulleys", friction=friction))
    cruise(winch, sign * 50.0, 0.5)
    expected = sliding(friction, [pi / 2, pi / 3], winch.load, sign)
    assert winch.tension == pytest.approx(expected, rel=2e-5)


def test_presliding_pulleys_end_where_dry_ones_are() -> None:
    dry = plant(GROOVED, hide("sticky pulleys", friction=0.02))
    soft = plant(GROOVED, hide("presliding pulleys", friction=0.02, stiffness="1 N/mm"))
    for winch in (dry, soft):
        cruise(winch, 50.0, 1.0)
    assert soft.tension == pytest.approx(dry.tension, rel=1e-6)
    # After a reversal dry friction turns with the speed, the soft one only with the travel.
    turned = dry.tension
    for winch in (dry, soft):
        for speed in range(50, -1, -1):
            cruise(winch, float(speed), 0.02)
        cruise(winch, -0.5, 0.3)
    assert dry.tension < dry.load < soft.tension < turned


@pytest.mark.parametrize("speed", [40.0, -40.0, 120.0])
def test_viscous_pulleys_count_each(speed: float) -> None:
    winch = plant(GROOVED, hide("viscous pulleys", viscosity="10 N s/m"))
    cruise(winch, speed, 0.5)
    rope = speed * sqrt(0.06**2 + (0.005 / 2 / pi) ** 2) / 20.4
    assert winch.tension - winch.load == pytest.approx(2 * 10 * rope, rel=1e-6)


def test_creep_friction_is_larger_at_creep_speed() -> None:
    added = []
    for speed in (2.0, 10.0, 100.0):
        winch = plant(GROOVED, hide("creep-sticky pulleys"))
        cruise(winch, speed, 0.5)
        added.append(winch.tension - winch.load)
    assert added[0] > added[1] > added[2] > 0
