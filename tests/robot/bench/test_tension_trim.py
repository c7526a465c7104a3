"""Correction of cable forces: convergence, and bounds whatever the load cells read."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from winchkit.arrays import Array
from winchkit.bench.bench import Bench
from winchkit.bench.open import open_bench
from winchkit.catalog import find
from winchkit.errors import NotPermitted, UsageError
from winchkit.robot import Robot, robot_of
from winchkit.robot.bench import platform as platform_module
from winchkit.robot.bench.tension_trim import ForceTrim, TrimSetting
from winchkit.robot.forces.force_distribution import null_space
from winchkit.schema.bench import LimitSpec
from winchkit.schema.read import read_robot, read_simbench
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench

CYCLE = 0.02
LIMITS = LimitSpec(0.3, 1.0, response_time=0.06)
STIFFNESS = np.linspace(2e4, 6e4, 8)
WANTED = np.full(8, 500.0)


@pytest.fixture(scope="module")
def structure() -> Array:
    robot: Robot = robot_of(read_robot(find("profiles", "winding-device-8")))
    return np.asarray(robot.structure(robot.home)[0])


class Cables:
    """Elastic cables of a platform that keeps its place, read with a delay."""

    def __init__(self, structure: Array, force: Array, travel: float = 0.01) -> None:
        null = null_space(structure)
        self.force, self.first = force, force
        self.read = lambda: self.force
        self.trips: list[str] = []
        self.balanced = null @ null.T
        setting = TrimSetting(
            tuple("12345678"), WANTED, self.balanced, STIFFNESS, 0.3, travel, 0.005, 12.0
        )
        self.trim = ForceTrim(
            setting, [LIMITS] * 8, self._readings, lambda _index, words: self.trips.append(words)
        )
        for index in range(8):
            self.trim.join(index)
        self.time = 100.0
        self._past: list[Array] = []

    def _readings(self, _now: float) -> Array:
        self._past.append(self.read())
        return self._past[max(0, len(self._past) - 13)]

    def step(self, stiffness: Array) -> tuple[Array, Array]:
        """A cycle; wound cable and speeds."""
        self.time += CYCLE
        pairs = [self.trim.at(index, self.time, self.time) for index in range(8)]
        wound, speed = np.array(pairs).T
        self.force = self.first + stiffness * wound
        return wound, speed

    @property
    def missing(self) -> float:
        """Of forces that balance each other, N."""
        return float(np.linalg.norm(self.balanced @ (WANTED - self.force)))


deviations = st.lists(st.floats(-150.0, 150.0), min_size=8, max_size=8)


@settings(max_examples=10, deadline=None)
@given(deviation=deviations, softer=st.floats(0.6, 1.0))
def test_balanced_forces_converge_and_the_platform_keeps_its_balance(
    structure: Array, deviation: list[float], softer: float
) -> None:
    cables = Cables(structure, WANTED + np.array(deviation))
    begin, before = cables.missing, structure @ cables.first
    largest = begin
    for _ in range(round(13.0 / CYCLE)):
        cables.step(STIFFNESS * softer)
        largest = max(largest, cables.missing)
    assert cables.trim.ended
    assert not cables.trips
    assert cables.missing <= 0.02 * begin + 0.1
    assert largest <= begin * (1 + 1e-9), "it never makes it worse"
    # The sum of forces and moments on the platform is what it was.
    assert structure @ cables.force == pytest.approx(before, abs=1e-6 * 500)


@settings(max_examples=10, deadline=None)
@given(
    values=st.lists(st.one_of(st.floats(-1e4, 1e4), st.just(math.nan)), min_size=8, max_size=8),
    travel=st.floats(0.002, 0.02),
)
def test_whatever_the_cells_read_each_cable_stays_within_travel_and_speed(
    structure: Array, values: list[float], travel: float
) -> None:
    cables = Cables(structure, WANTED, travel)
    shown = np.array(values)
    cables.read = lambda: shown
    speeds = [np.zeros(8)]
    for _ in range(round(13.0 / CYCLE)):
        wound, speed = cables.step(STIFFNESS)
        assert np.abs(wound).max() <= travel + 1e-9
        assert np.abs(speed).max() <= 0.005 + 1e-9
        assert np.abs(speed - speeds[-1]).max() <= LIMITS.acceleration * CYCLE + 1e-9
        speeds.append(speed)
    if np.isnan(shown).any():
        assert not np.any(speeds), "without a reading of each cable nothing moves"


def test_a_cell_that_stands_still_trips_at_the_travel(structure: Array) -> None:
    cables = Cables(structure, WANTED, 0.004)
    shown = WANTED + cables.balanced @ np.array([-200.0, 0, 0, 0, 0, 0, 0, 0])
    cables.read = lambda: shown
    for _ in range(round(11.0 / CYCLE)):
        wound, _ = cables.step(STIFFNESS)
    assert "4 mm of cable (travel of the trim)" in cables.trips[0]
    assert np.abs(wound).max() == pytest.approx(0.004, abs=5e-4)


def test_a_stop_ramps_all_cables_to_rest_together(structure: Array) -> None:
    cables = Cables(structure, WANTED - cables_off())
    for _ in range(30):
        cables.step(STIFFNESS)
    cables.trim.end()
    for _ in range(3):
        _, speed = cables.step(STIFFNESS)
    assert not speed.any()
    assert cables.trim.ended


def cables_off() -> Array:
    return np.array([100.0, 0, 0, 0, 50.0, 0, 0, 0])


def test_without_a_cell_at_each_winch_it_is_refused(bench: Bench) -> None:
    with pytest.raises(NotPermitted, match="winch 1 has no load cell"):
        bench.robot.trim()
    with pytest.raises(UsageError, match="is not a"):
        bench.robot.trim(travel=-0.01)


@pytest.mark.slow
def test_forces_that_the_drives_do_not_give_are_refused_before_anything_moves() -> None:
    """The middle of 5 N and 220 N at a drum of 60 mm is 6.75 N m, of 6 N m."""
    sim = read_simbench(find("sim", "cabtive-robot"))
    assert sim.bench.robot is not None
    wiring = replace(sim.bench.robot, tension=(5.0, 220.0))
    sim = replace(sim, bench=replace(sim.bench, cycle=0.04, robot=wiring))
    clock = SimulatedClock()
    with LiveBench(sim, simulated_time=clock) as live, open_bench(live.bench_spec, clock) as bench:
        clock.sleep(0.5)
        with pytest.raises(
            NotPermitted, match=r"needs 6\.\d+ N m .* the drive gives 6 N m at most"
        ):
            bench.robot.trim()
        assert not bench.robot.moving
        # A motion by length moves; the correction at its end is what is refused.
        bench.robot.move(bench.robot.moved({"z": 0.005}, relative=True))


@pytest.mark.slow
def test_a_declared_trim_follows_each_motion_and_a_stop_ends_it(
    structure: Array, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        platform_module, "greatest_stiffness", lambda _cable, length, _bound: 250e3 / length
    )
    sim = read_simbench(find("sim", "winding-device-robot"))
    assert sim.bench.robot is not None
    bus = {**sim.bench.bus, "can": replace(sim.bench.bus["can"], heartbeat=0.1)}
    wiring = replace(sim.bench.robot, tension_trim=True)
    sim = replace(sim, bench=replace(sim.bench, cycle=CYCLE, bus=bus, robot=wiring))
    clock = SimulatedClock()
    null = null_space(structure)

    def missing() -> float:
        with live.up_to_date():
            assert live.robot is not None
            force = np.array(live.robot.platform.tension)
        return float(np.linalg.norm(null @ null.T @ (force - 502.5)))

    with (
        LiveBench(sim, seed=2, simulated_time=clock) as live,
        open_bench(live.bench_spec, clock) as bench,
    ):
        clock.sleep(0.2)
        bench.winch["3"].move_by(wind_in=0.003, speed=0.01)
        before = missing()
        bench.robot.move(bench.robot.moved({"z": 0.01}, relative=True), 0.05, wait=False)
        clock.sleep(2.0)
        assert bench.robot.moving, "the correction is under way"
        clock.sleep(2.0)
        bench.stop()
        assert bench.snapshot.at_rest
        assert not bench.snapshot.tripped
        assert before > 50.0
        assert missing() < 0.7 * before
