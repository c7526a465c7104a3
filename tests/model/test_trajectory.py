"""Planned moves of the model and of the simulator: their limits, their end and closed forms."""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.errors import UsageError
from winchkit.model.trajectory import plan
from winchkit.sim.schedule import plan as simulated_plan

Plan = Callable[[float, float, float, float], Any]
limits, jerks = st.floats(1e-2, 20.0), st.floats(0.05, 500.0)
distances = st.floats(-20.0, 20.0).filter(lambda d: abs(d) > 1e-6)
both = pytest.mark.parametrize("planned", [plan, simulated_plan], ids=["model", "simulator"])


@both
@given(distance=distances, speed=limits, acceleration=limits, jerk=jerks)
def test_keeps_every_limit_and_arrives_at_rest(
    planned: Plan, distance: float, speed: float, acceleration: float, jerk: float
) -> None:
    move = planned(distance, speed, acceleration, jerk)
    assert move.at(-1.0)[:2] == (0.0, 0.0)
    assert move.at(move.duration + 0.1)[:2] == (pytest.approx(distance, rel=1e-9), 0.0)
    assert move.at(move.duration * (1 - 1e-9))[0] == pytest.approx(distance, abs=1e-6)
    step = move.duration / 400
    way, velocity = np.array([move.at(k * step)[:2] for k in range(401)]).T
    assert np.all(np.diff(way) * math.copysign(1, distance) >= -1e-9 * abs(distance))
    assert np.max(np.abs(velocity)) <= speed * (1 + 1e-9)
    if move.duration > 1e-3:
        slopes = np.diff(velocity) / step
        assert np.max(np.abs(slopes)) <= acceleration * (1 + 1e-6)
        assert max(abs(b - a) for a, b in pairwise(slopes)) <= step * jerk * (1 + 1e-6) + 1e-6


@both
@given(distance=st.floats(0.01, 20.0), speed=limits, acceleration=limits, jerk=jerks)
def test_speed_is_the_derivative_of_distance(
    planned: Plan, distance: float, speed: float, acceleration: float, jerk: float
) -> None:
    move = planned(distance, speed, acceleration, jerk)
    h = move.duration * 1e-5
    for time in np.linspace(2 * h, move.duration - 2 * h, 17):
        slope = (move.at(time + h)[0] - move.at(time - h)[0]) / (2 * h)
        tolerance = jerk * h**2 + 1e-12 * distance / h
        assert slope == pytest.approx(move.at(time)[1], abs=tolerance)


@given(distance=st.floats(0.01, 5.0), speed=limits, acceleration=limits, jerk=limits)
def test_the_model_gives_the_acceleration_and_reaches_one_limit(
    distance: float, speed: float, acceleration: float, jerk: float
) -> None:
    """Otherwise a faster move would exist."""
    move = plan(distance, speed, acceleration, jerk)
    h = move.duration * 1e-5
    time = np.linspace(2 * h, move.duration - 2 * h, 57)
    slope = (move.at(time + h)[1] - move.at(time - h)[1]) / (2 * h)
    assert np.allclose(slope, move.at(time)[2], atol=jerk * h + 1e-12 * speed / h)
    assert np.max(np.abs(move.at(time)[2])) <= acceleration * (1 + 1e-9)
    reached = np.max(move.speed) == pytest.approx(speed)
    assert reached or move.start[4] == pytest.approx(move.start[3])


@both
@pytest.mark.parametrize(
    ("speed", "acceleration", "jerk", "duration"),
    [
        # Worked by hand: 1 m at 0.5 m/s, 1 m/s², 2 m/s³: ramps of 0.5/1 + 0.5 s, then cruise.
        (0.5, 1.0, 2.0, 1 / 0.5 + 0.5 / 1.0 + 1.0 / 2.0),
        (1.0, 2.0, 8.0, 1.0 + 0.75),
        # No cruise, no constant acceleration: 4 (d / 2j)^(1/3).
        (100.0, 100.0, 4.0, 4 * (1.0 / 8.0) ** (1 / 3)),
    ],
)
def test_duration_by_hand(
    planned: Plan, speed: float, acceleration: float, jerk: float, duration: float
) -> None:
    move = planned(-1.0, speed, acceleration, jerk)
    assert move.duration == pytest.approx(duration)
    assert move.at(duration / 2)[0] == pytest.approx(-0.5)


@both
@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_a_limit_must_be_positive(planned: Plan, bad: float, place: int) -> None:
    given = [1.0, 1.0, 1.0]
    given[place] = bad
    with pytest.raises(UsageError, match=r"(speed|acceleration|jerk) limit|must be positive"):
        planned(1.0, *given)


@pytest.mark.parametrize("bad", [math.inf, math.nan])
def test_a_move_that_cannot_be_meant_is_refused(bad: float) -> None:
    with pytest.raises(UsageError, match="cannot be planned"):
        plan(bad, 1.0, 1.0, 1.0)
    with pytest.raises(UsageError, match="speed limit"):
        plan(1.0, math.inf, 1.0, 1.0)


@both
def test_no_distance_takes_no_time(planned: Plan) -> None:
    move = planned(0.0, 1.0, 1.0, 1.0)
    assert move.duration == 0
    assert move.at(1.0)[0] == 0
