"""Pose by the tracker: convergence with a wrong geometry, and what trips it, whatever it shows."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from winchkit.arrays import Array
from winchkit.bench.control.snapshot import Trip
from winchkit.bench.tracker import TrackedPose
from winchkit.catalog import find
from winchkit.model.rotation import quaternion_of, rotation_by
from winchkit.robot import Robot, robot_of
from winchkit.robot.bench.correction import Bounds, Correction
from winchkit.robot.bench.pose_loop import PoseLoop, TrackerLimits, TrackerWatch
from winchkit.schema.bench import LimitSpec
from winchkit.schema.read import read_robot

CYCLE, AGE, DELAY = 0.01, 0.1, 2
LIMITS = TrackerLimits(AGE, 0.2, math.radians(20.0))


@pytest.fixture(scope="module")
def robot() -> Robot:
    return robot_of(read_robot(find("profiles", "winding-device-8")))


class Held:
    """A platform whose pose follows its cables exactly, with true derivatives of their lengths."""

    def __init__(
        self, robot: Robot, place: Array, *, wrong: float = 0.0, noise: float = 0.0
    ) -> None:
        random = np.random.default_rng(1)
        nominal = -robot.structure(robot.home)[0].T
        self._true = np.linalg.pinv(nominal * (1.0 + wrong * random.standard_normal(nominal.shape)))
        self._first, self._random, self._noise = place, random, noise
        self.place, self.home, self.time = place, robot.home, 10.0
        self.trips: list[Trip] = []
        self.shows: TrackedPose | None = None
        self._past: list[Array] = []
        names = robot.names
        self.loop = PoseLoop(
            robot.home, nominal, lambda: self.shows, TrackerWatch(LIMITS), self.trips.append
        )
        self.correction = Correction(
            Bounds(names, [LimitSpec(0.3, 1.0, response_time=0.06)] * len(names), 0.02, 0.05),
            [self.loop],
            lambda _elapsed, _now: True,
            self.trips.append,
            np.zeros((len(names), len(names))),
        )
        for index in range(len(names)):
            self.correction.join(index)

    def told(self, place: Array) -> TrackedPose:
        """A datagram of a pose beside the home pose."""
        turned = rotation_by(place[3:]) @ self.home.rotation[0]
        w, x, y, z = quaternion_of(turned).tolist()
        a, b, c = (self.home.position[0] + place[:3]).tolist()
        return TrackedPose(self.time, self.time, (a, b, c), (w, x, y, z))

    def step(self, *, shown: bool = True) -> Array:
        """A cycle; the speeds of the cables, m/s."""
        self.time += CYCLE
        self._past.append(self.place)
        if shown:
            seen = self._past[max(0, len(self._past) - 1 - DELAY)]
            self.shows = self.told(seen + self._noise * self._random.standard_normal(6))
        pairs = [self.correction.at(i, self.time, self.time) for i in range(8)]
        wound, speed = np.array(pairs).T
        self.correction.measured = wound
        self.place = self._first - self._true @ wound
        return speed


places = st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6).map(
    lambda x: np.array(x) * [2e-3, 2e-3, 2e-3, 4e-3, 4e-3, 4e-3]
)


@settings(max_examples=10, deadline=None)
@given(place=places)
def test_the_pose_converges_to_the_trackers_with_derivatives_that_are_wrong(
    robot: Robot, place: Array
) -> None:
    """Derivatives wrong by 0.1 %, as with points 2 mm off in 3 m; noise of 0.05 mm and mrad."""
    held = Held(robot, place, wrong=1e-3, noise=5e-5)
    for _ in range(round(9.0 / CYCLE)):
        held.step()
    assert not held.trips
    # Of the noise, σ √(0.01 s / 2τ) is left, 0.0035 mm in each direction.
    assert np.linalg.norm(held.place[:3]) < 0.03e-3
    assert np.linalg.norm(held.place[3:]) < 0.03e-3


@settings(max_examples=15, deadline=None)
@given(place=places, frozen=st.booleans())
def test_a_tracker_that_is_lost_or_stands_still_trips_within_its_age(
    robot: Robot, place: Array, *, frozen: bool
) -> None:
    held = Held(robot, place, noise=1e-5)
    for _ in range(20):
        held.step()
    last = held.shows
    assert last is not None
    began = held.time
    for _ in range(100):
        if frozen:  # the same numbers with a clock that goes on
            held.shows = last._replace(time=held.time + CYCLE, received=held.time + CYCLE)
        held.step(shown=False)
        if held.trips:
            break
    assert held.trips[0].kind == "tracker age"
    assert held.trips[0].latches
    assert held.time - began <= AGE + 2 * CYCLE
    for _ in range(10):
        speed = held.step(shown=False)
    assert not speed.any(), "without a pose all cables rest"


@settings(max_examples=25, deadline=None)
@given(
    way=st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3).filter(
        lambda x: max(map(abs, x)) > 0.1
    ),
    size=st.floats(0.006, 5.0),
    turns=st.booleans(),
)
def test_a_tracker_that_jumps_trips_with_the_datagram(
    robot: Robot, way: list[float], size: float, *, turns: bool
) -> None:
    """The limits are 1 mm and 0.2 deg, and 2 mm and 0.2 deg for 10 ms at [robot]'s speeds."""
    held = Held(robot, np.zeros(6), noise=1e-5)
    for _ in range(20):
        held.step()
    jump = np.zeros(6)
    part = slice(3, 6) if turns else slice(3)
    jump[part] = np.array(way) / np.linalg.norm(way) * (min(size, 3.0) if turns else size)
    held.shows = held.told(held.place + jump)._replace(
        received=held.time + CYCLE, time=held.time + CYCLE
    )
    held.step(shown=False)
    expected = "tracker jump" if not turns or size > math.radians(0.42) else ""
    assert [trip.kind for trip in held.trips] == ([expected] if expected else [])


@settings(max_examples=10, deadline=None)
@given(way=places.filter(lambda x: np.linalg.norm(x[:3]) > 1e-3))
def test_a_tracker_that_is_carried_away_slowly_trips_before_the_platform_follows_far(
    robot: Robot, way: Array
) -> None:
    held = Held(robot, np.zeros(6), noise=1e-5)
    rate = way / np.linalg.norm(way[:3]) * 3e-3 * CYCLE
    drift = np.zeros(6)
    for _ in range(1000):
        drift = drift + rate
        held.time += CYCLE
        held.shows = held.told(held.place + drift)
        held.time -= CYCLE
        held.step(shown=False)
        if held.trips:
            break
    assert held.trips[0].kind == "tracker disagreement"
    assert np.linalg.norm(drift[:3]) < 6e-3
    assert np.linalg.norm(held.place[:3]) < 6e-3


@settings(max_examples=15, deadline=None)
@given(
    shown=st.lists(st.tuples(places, st.floats(-1.0, 1.0), st.booleans()), min_size=20, max_size=60)
)
def test_whatever_the_tracker_shows_cables_stay_within_travel_speed_and_acceleration(
    robot: Robot, shown: list[tuple[Array, float, bool]]
) -> None:
    held, before = Held(robot, np.zeros(6)), np.zeros(8)
    for place, scale, comes in shown:
        held.time += CYCLE
        if comes:
            held.shows = held.told(place * 50.0 * scale)
        held.time -= CYCLE
        speed = held.step(shown=False)
        assert np.abs(speed).max() <= 0.05 + 1e-9
        assert np.abs(speed - before).max() <= 1.0 * CYCLE + 1e-9
        assert np.abs(held.correction.measured).max() <= 0.02
        before = speed
