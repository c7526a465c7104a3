"""The S-curve keeps its limits and arrives, whatever it is asked."""

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from winchkit.errors import UsageError
from winchkit.sim.plant.trajectory import plan

distances = st.floats(-20, 20)
limits = st.floats(0.01, 10)


@settings(max_examples=200, deadline=None)
@given(distances, limits, limits, st.floats(0.01, 100))
def test_keeps_limits_and_arrives(
    distance: float, speed: float, acceleration: float, jerk: float
) -> None:
    move = plan(distance, speed, acceleration, jerk)
    assert move.at(-1.0) == (0.0, 0.0)
    assert move.at(move.duration) == (distance, 0.0)
    just_before = move.at(move.duration * (1 - 1e-9))
    assert just_before[0] == pytest.approx(distance, abs=1e-6)
    n = 400
    dt = move.duration / n
    rows = [move.at(i * dt) for i in range(n + 1)]
    assert max(abs(v) for _, v in rows) <= speed * (1 + 1e-9)
    if move.duration > 1e-3:
        steps = [(b[1] - a[1]) / dt for a, b in pairwise(rows)]
        assert max(map(abs, steps)) <= acceleration * (1 + 1e-6)
        jerks = [(b - a) / dt for a, b in pairwise(steps)]
        assert max(map(abs, jerks)) <= jerk * (1 + 1e-6) + 1e-6


@given(distances.filter(lambda d: abs(d) > 1e-3), limits, limits, st.floats(0.01, 100))
@settings(max_examples=100, deadline=None)
def test_speed_is_the_derivative_of_distance(
    distance: float, speed: float, acceleration: float, jerk: float
) -> None:
    move = plan(distance, speed, acceleration, jerk)
    h = move.duration * 1e-5
    for share in (0.03, 0.2, 0.4, 0.5, 0.77, 0.95):
        t = share * move.duration
        slope = (move.at(t + h)[0] - move.at(t - h)[0]) / (2 * h)
        assert slope == pytest.approx(move.at(t)[1], rel=1e-3, abs=1e-6 * abs(distance) / h * 1e-4)


@pytest.mark.parametrize(
    ("speed", "acceleration", "jerk", "duration"),
    [
        # worked by hand: 1 m at 0.5 m/s, 1 m/s², 2 m/s³: 0.5/1 + 0.5 s of ramp, then cruise
        (0.5, 1.0, 2.0, 1 / 0.5 + 0.5 / 1.0 + 1.0 / 2.0),
        # no cruise, no constant acceleration: 4 (d / 2j)^(1/3)
        (100.0, 100.0, 4.0, 4 * (1.0 / 8.0) ** (1 / 3)),
    ],
)
def test_duration_by_hand(speed: float, acceleration: float, jerk: float, duration: float) -> None:
    assert plan(1.0, speed, acceleration, jerk).duration == pytest.approx(duration)


@pytest.mark.parametrize("bad", [(0, 1, 1), (1, -1, 1), (1, 1, float("nan"))])
def test_a_limit_must_be_positive(bad: tuple[float, float, float]) -> None:
    with pytest.raises(UsageError, match="must be positive"):
        plan(1.0, *bad)


def test_no_distance_takes_no_time() -> None:
    assert plan(0.0, 1.0, 1.0, 1.0).duration == 0.0
