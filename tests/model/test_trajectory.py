"""A planned move against its limits, its end and numerical integration."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.errors import UsageError
from winchkit.model.trajectory import plan

limits = st.floats(1e-2, 20.0)


@given(
    distance=st.floats(-20.0, 20.0).filter(lambda d: abs(d) > 1e-6),
    speed=limits,
    acceleration=limits,
    jerk=st.floats(0.1, 500.0),
)
def test_keeps_every_limit_and_arrives_at_rest(
    distance: float, speed: float, acceleration: float, jerk: float
) -> None:
    move = plan(distance, speed, acceleration, jerk)
    time = np.linspace(-0.1, move.duration + 0.1, 801)
    s, v, a = move.at(time)
    assert s[0] == 0
    assert s[-1] == pytest.approx(distance, rel=1e-9)
    assert v[0] == v[-1] == 0
    assert np.max(np.abs(v)) <= speed * (1 + 1e-9)
    assert np.max(np.abs(a)) <= acceleration * (1 + 1e-9)
    step = (s[1:] - s[:-1]) * math.copysign(1, distance)
    assert np.all(step >= -1e-9 * abs(distance))


@given(distance=st.floats(0.01, 5.0), speed=limits, acceleration=limits, jerk=limits)
def test_speed_is_the_derivative_of_position(
    distance: float, speed: float, acceleration: float, jerk: float
) -> None:
    move = plan(distance, speed, acceleration, jerk)
    h = move.duration * 1e-5
    time = np.linspace(2 * h, move.duration - 2 * h, 57)
    s_before, v_before, _ = move.at(time - h)
    s_after, v_after, _ = move.at(time + h)
    _, v, a = move.at(time)
    assert np.allclose((s_after - s_before) / (2 * h), v, atol=jerk * h**2 + 1e-12 * distance / h)
    assert np.allclose((v_after - v_before) / (2 * h), a, atol=jerk * h + 1e-12 * speed / h)


@given(distance=st.floats(0.01, 5.0), speed=limits, acceleration=limits, jerk=limits)
def test_one_limit_is_always_reached(
    distance: float, speed: float, acceleration: float, jerk: float
) -> None:
    """Otherwise a faster move would exist."""
    move = plan(distance, speed, acceleration, jerk)
    assert np.max(move.speed) == pytest.approx(speed) or move.start[4] == pytest.approx(
        move.start[3]
    )


def test_known_move() -> None:
    """1 m at 1 m/s, 2 m/s^2, 8 m/s^3: ramps of 0.25 + 0.5 s, by hand."""
    move = plan(-1.0, 1.0, 2.0, 8.0)
    assert move.duration == pytest.approx(1.0 + 0.75)
    assert move.at(move.duration / 2)[0] == pytest.approx(-0.5)


@pytest.mark.parametrize("bad", [0.0, -1.0, math.inf, math.nan])
def test_limits_that_cannot_be_meant_are_refused(bad: float) -> None:
    with pytest.raises(UsageError, match="speed limit"):
        plan(1.0, bad, 1.0, 1.0)
    with pytest.raises(UsageError, match="cannot be planned"):
        plan(math.nan, 1.0, 1.0, 1.0)


def test_no_distance_takes_no_time() -> None:
    move = plan(0.0, 1.0, 1.0, 1.0)
    assert move.duration == 0
    assert move.at(1.0)[0] == 0
