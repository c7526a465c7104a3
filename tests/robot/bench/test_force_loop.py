"""Control of cable forces: convergence, steps, and bounds whatever the load cells read."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from winchkit.arrays import Array
from winchkit.bench.bench import Bench
from winchkit.bench.control.snapshot import Trip
from winchkit.bench.open import open_bench
from winchkit.catalog import find
from winchkit.errors import MotionError, NotPermitted, UsageError
from winchkit.robot import Robot, robot_of
from winchkit.robot.bench.balance_check import MOST, BalanceCheck, check_of, sources_of
from winchkit.robot.bench.correction import Bounds, Correction
from winchkit.robot.bench.corrections import elongating
from winchkit.robot.bench.force_loop import ForceLoop, ForceSetting
from winchkit.robot.bench.platform import Platform
from winchkit.robot.bench.pose_loop import PoseLoop, TrackerLimits, TrackerWatch
from winchkit.robot.forces.force_distribution import ForceLimits, null_space, quadratic
from winchkit.schema.bench import LimitSpec
from winchkit.schema.read import read_robot, read_simbench
from winchkit.schema.robot_bench import RobotWiring
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench

CYCLE, DELAY = 0.02, 12
LIMITS = LimitSpec(0.3, 1.0, response_time=0.06)
STIFFNESS = np.linspace(2e4, 6e4, 8)
WANTED = np.full(8, 500.0)


ROBOT: Robot = robot_of(read_robot(find("profiles", "winding-device-8")))
SLACK = 30.0


@contextmanager
def simulated(
    robot: str = "winding-device-robot", cycle: float = CYCLE, **wiring: Any
) -> Iterator[tuple[LiveBench, SimulatedClock]]:
    """A live robot with these numbers of ``[robot]``, and its clock."""
    sim = read_simbench(find("sim", robot))
    assert sim.bench.robot is not None
    own = replace(sim.bench.robot, **wiring)
    sim, clock = replace(sim, bench=replace(sim.bench, cycle=cycle, robot=own)), SimulatedClock()
    with LiveBench(sim, seed=2, simulated_time=clock) as live:
        yield live, clock


@pytest.fixture(scope="module")
def structure() -> Array:
    return np.asarray(ROBOT.structure(ROBOT.home)[0])


@cache
def check() -> BalanceCheck:
    wiring = RobotWiring("winding-device-8", 0.2, (60.0, 2000.0))
    sources = sources_of(ROBOT, wiring, 1 / STIFFNESS, described=False)
    return check_of(ROBOT, sources, ROBOT.home, WANTED[None])


class Cables:
    """Elastic cables of a platform that keeps its place, read with a delay."""

    def __init__(
        self,
        structure: Array,
        force: Array,
        travel: float = 0.01,
        *,
        speed: float = 0.005,
        known: bool = False,
        unknown: float = 0.0,
        balance: BalanceCheck | None = None,
    ) -> None:
        null = null_space(structure)
        self.force, self.first = force, force
        self.read = lambda: self.force
        self.trips: list[Trip] = []
        self.balanced = null @ null.T
        names, limits = tuple("12345678"), [LIMITS] * 8
        setting = ForceSetting(
            names,
            WANTED,
            self.balanced,
            STIFFNESS,
            known,
            delay=0.3,
            lag=DELAY * CYCLE,
            speed=speed,
            acceleration=1.0,
            unknown=np.full(8, unknown),
            slack=SLACK,
            check=balance or check(),
        )
        self.loop = ForceLoop(setting, self._readings, self.trips.append)
        self.correction = Correction(
            Bounds(names, limits, travel, speed),
            [self.loop],
            lambda elapsed, _now: elapsed < 12.0,
            self.trips.append,
            np.eye(8),
        )
        for index in range(8):
            self.correction.join(index)
        self.time = 100.0
        self._past: list[Array] = []

    def _readings(self, _now: float) -> Array:
        self._past.append(self.read())
        return self._past[max(0, len(self._past) - 1 - DELAY)]

    def step(self, stiffness: Array) -> tuple[Array, Array]:
        """A cycle; wound cable and speeds."""
        self.time += CYCLE
        pairs = [self.correction.at(index, self.time, self.time) for index in range(8)]
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
    null = null_space(structure)
    cables = Cables(structure, WANTED + null @ null.T @ np.array(deviation))
    begin, before = cables.missing, structure @ cables.first
    largest = begin
    for _ in range(round(13.0 / CYCLE)):
        cables.step(STIFFNESS * softer)
        largest = max(largest, cables.missing)
    assert cables.correction.ended
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
    assert cables.trips[0].kind == "correction"
    assert "4 mm of cable (travel of the correction)" in cables.trips[0].message
    assert np.abs(wound).max() == pytest.approx(0.004, abs=5e-4)


@settings(max_examples=20, deadline=None)
@given(index=st.integers(0, 7), share=st.floats(0.5, 6.0), sign=st.sampled_from([-1.0, 1.0]))
def test_a_cell_that_jumps_by_more_than_is_explained_trips_and_moves_no_cable_far(
    structure: Array, index: int, share: float, sign: float
) -> None:
    """Of 310 N at forces of 500 N, where no friction of the pulleys is declared."""
    assume(abs(share - 1.0) > 0.05)
    cables = Cables(structure, balanced_forces(structure), speed=0.05, known=True)
    for _ in range(100):
        cables.step(STIFFNESS)
    one = np.eye(8)[index]
    jump = share * MOST / check().size(0, one)
    assert 250.0 < jump / share < 350.0
    cables.read = lambda: cables.force + sign * jump * one
    for _ in range(DELAY + 1):
        assert not cables.trips, "the reading has not come yet"
        cables.step(STIFFNESS)
    for _ in range(round(0.4 / CYCLE)):  # 0.1 s times the logarithm of 20, and a cycle
        cables.step(STIFFNESS)
    kinds = [trip.kind for trip in cables.trips]
    if share < 1.0:
        assert "cable forces" not in kinds
        return
    assert kinds[:1] == ["cable forces"]
    trip = cables.trips[0]
    assert trip.latches
    assert trip.winch == str(index + 1)
    named = re.search(rf"cable {index + 1} that is wrong by ([-+]\d+) N", trip.message)
    assert named is not None
    # Until then the loop has changed the force of the cable a little.
    assert float(named[1]) == pytest.approx(sign * jump, rel=0.02)
    assert np.abs(cables.correction.at(0, cables.time, cables.time)[0]) < 0.01


@pytest.mark.parametrize("index", range(8))
def test_a_cable_that_becomes_slack_trips_although_the_others_carry_the_weight(
    structure: Array, index: int
) -> None:
    taut = balanced_forces(structure)
    broken = np.where(np.arange(8) == index, 5.0, taut)
    # The platform has moved to where the others balance, so that no wrench is left over.
    balance = replace(check(), whiten=np.zeros_like(check().whiten))
    cables = Cables(structure, taut, balance=balance)
    for _ in range(5):  # the first one only starts
        cables.step(STIFFNESS)
    cables.read = lambda: broken
    for _ in range(DELAY + round(0.1 / CYCLE) + 2):
        cables.step(STIFFNESS)
    first = cables.trips[0]
    assert (first.kind, first.winch, first.latches) == ("cable forces", str(index + 1), True)
    assert "below 30.0 N" in first.message
    # One that is slack from the beginning is wound in, within the travel.
    cables = Cables(structure, broken, known=True, balance=balance)
    cables.loop.force = taut
    for _ in range(50):
        cables.step(STIFFNESS)
    assert not cables.trips
    assert cables.correction.at(index, cables.time, cables.time)[0] > 0


@settings(max_examples=20, deadline=None)
@given(steps=st.lists(st.floats(-100.0, 100.0), min_size=1, max_size=4), softer=st.floats(0.9, 1.0))
def test_a_step_of_a_known_stiffness_is_fed_forward_without_overshoot(
    structure: Array, steps: list[float], softer: float
) -> None:
    first = balanced_forces(structure)
    cables = Cables(structure, first, 0.03, speed=0.05, known=True)
    cables.loop.force = first
    cables.step(STIFFNESS)
    way = cables.balanced @ np.eye(8)[0]
    for step in steps:
        before, aim = cables.force, cables.loop.force + step * way / way[0]
        cables.loop.aim(aim)
        wanted = float(np.abs(aim - before).max())
        for _ in range(round(0.3 / CYCLE)):
            cables.step(STIFFNESS * softer)
            beyond = (cables.force - aim) * np.sign(aim - before)
            assert beyond.max() <= 0.02 * wanted + 1.0
        assert np.abs(cables.force - aim).max() <= (1.0 - softer) * wanted + 0.05 * wanted + 1.0
        for _ in range(100):
            cables.step(STIFFNESS * softer)


@given(size=st.floats(0.0, 60.0), share=st.floats(0.0, 0.02))
@settings(max_examples=20, deadline=None)
def test_deviations_that_unknown_friction_explains_are_left(
    structure: Array, size: float, share: float
) -> None:
    first = balanced_forces(structure)
    null = null_space(structure)[:, 0]
    cables = Cables(structure, first + size * null, unknown=share)
    cables.loop.force = first
    for _ in range(round(13.0 / CYCLE)):
        cables.step(STIFFNESS)
    left = float(np.linalg.norm(cables.balanced @ (first - cables.force)))
    # Two standard deviations of independent errors, in the two directions that are free.
    explained = 2.0 * share * float(np.sqrt(np.diag(cables.balanced) @ cables.force**2))
    assert left == pytest.approx(min(size, explained), rel=0.03, abs=0.2)


def balanced_forces(structure: Array) -> Array:
    """Forces that hold the platform, near 500 N."""
    return quadratic(structure, ROBOT.weight(ROBOT.home)[0], ForceLimits(60.0, 940.0)).value


def test_a_stop_ramps_all_cables_to_rest_together(structure: Array) -> None:
    cables = Cables(structure, WANTED - cables_off())
    for _ in range(30):
        cables.step(STIFFNESS)
    cables.correction.end()
    for _ in range(3):
        _, speed = cables.step(STIFFNESS)
    assert not speed.any()
    assert cables.correction.ended


def cables_off() -> Array:
    return np.array([100.0, 0, 0, 0, 50.0, 0, 0, 0])


def test_without_a_cell_at_each_winch_it_is_refused(bench: Bench) -> None:
    with pytest.raises(NotPermitted, match="winch 1 has no load cell"):
        bench.robot.trim()
    with pytest.raises(UsageError, match="is not a"):
        bench.robot.trim(travel=-0.01)
    with pytest.raises(NotPermitted, match="winch 1 has no load cell"):
        bench.robot.hold(preload=150.0)
    with pytest.raises(NotPermitted, match="declares no tracker"):
        bench.robot.hold(pose=bench.robot.pose)
    with pytest.raises(NotPermitted, match=r"cables 1, 2, 3 cannot .* leaves 2 free"):
        bench.robot.hold(preload={"1": 150.0, "2": 150.0, "3": 20.0})
    with pytest.raises(UsageError, match="give a preload, a pose"):
        bench.robot.hold()
    with pytest.raises(UsageError, match="'Z' is no cable"):
        bench.robot.hold(preload={"Z": 150.0})
    with pytest.raises(MotionError, match="no preload is held"):
        bench.robot.set_preload(150.0)
    assert not bench.robot.moving


@pytest.mark.slow
def test_forces_that_the_drives_do_not_give_are_refused_before_anything_moves() -> None:
    """The middle of 5 N and 220 N at a drum of 60 mm is 6.75 N m, of 6 N m."""
    with (
        simulated("cabtive-robot", 0.04, tension=(5.0, 220.0)) as (live, clock),
        open_bench(live.bench_spec, clock) as bench,
    ):
        clock.sleep(0.5)
        with pytest.raises(
            NotPermitted, match=r"needs 6\.\d+ N m .* the drive gives 6 N m at most"
        ):
            bench.robot.trim()
        assert not bench.robot.moving
        # A motion by length moves; the correction at its end is what is refused.
        bench.robot.move(bench.robot.moved({"z": 0.005}, relative=True))


@pytest.mark.slow
def test_a_declared_trim_follows_each_motion_and_a_stop_ends_it(structure: Array) -> None:
    null = null_space(structure)

    def missing() -> float:
        with live.up_to_date():
            assert live.robot is not None
            force = np.array(live.robot.platform.tension)
        return float(np.linalg.norm(null @ null.T @ (force - 502.5)))

    with (
        simulated(tension_trim="end", axial_stiffness=250e3) as (live, clock),
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


@settings(max_examples=30, deadline=None)
@given(
    forces=st.lists(st.floats(-100.0, 100.0), min_size=2, max_size=2),
    pose=st.lists(st.floats(-1e-3, 1e-3), min_size=6, max_size=6),
    spread=st.lists(st.floats(0.5, 1.5), min_size=8, max_size=8),
)
def test_cable_wound_for_forces_changes_no_pose(
    structure: Array, forces: list[float], pose: list[float], spread: list[float]
) -> None:
    """Beside a pose loop; alone a force loop changes nothing else, and a pose loop no forces."""
    stiffness, by_pose = STIFFNESS * np.array(spread), -structure.T
    cables = Cables(structure, WANTED)
    force = cables.loop
    force.setting = replace(force.setting, stiffness=stiffness)
    tracker = PoseLoop(
        ROBOT.home, by_pose, lambda: None, TrackerWatch(TrackerLimits(0.1, 0.2, 0.3)), print
    )
    elastic = null_space(structure) @ forces / stiffness
    wound = elastic + by_pose @ pose
    assert elongating([force, tracker], 8) @ wound == pytest.approx(elastic, abs=1e-12)
    assert elongating([force], 8) @ wound == pytest.approx(wound)
    assert not (elongating([tracker], 8) @ wound).any()


@pytest.mark.slow
def test_the_pose_stays_that_of_the_plan_where_cells_correct_along_it(tmp_path: Path) -> None:
    """Also for a later process, by the record of positions, and until a winch is homed.

    Without that millimetres of elongation turn the pose by the lengths: this robot's cables hold
    its rotation about z 50 times more softly than its position.
    """
    with simulated(tension_trim="along", axial_stiffness=200e3) as (live, clock):
        spec = replace(live.bench_spec, latch_file=str(tmp_path / "bench.trip.json"))

        def off(platform: Platform) -> float:
            with live.up_to_date():
                assert live.robot is not None
                return float(
                    np.linalg.norm(platform.pose.position[0] - live.robot.platform.position)
                )

        with open_bench(spec, clock) as bench:
            clock.sleep(0.5)
            for x, y in ((-0.05, -0.05), (0.05, -0.05), (0.05, 0.05)):
                goal = bench.robot.moved({"x": x, "y": y}, relative=False)
                bench.robot.move(goal, 0.1, 0.2)
            trims = [one.trim_angle for one in bench.snapshot.winch.values()]
            assert off(bench.robot) < 1e-3
        with open_bench(spec, clock) as bench:
            clock.sleep(0.5)
            assert [one.trim_angle for one in bench.snapshot.winch.values()] == pytest.approx(trims)
            assert off(bench.robot) < 1e-3
            winch = bench.winch["1"]
            winch.home(at=winch.cable_length)
            assert bench.snapshot.winch["1"].trim_angle == 0.0 != trims[0]


@pytest.mark.slow
@pytest.mark.parametrize("trim", ["none", "along"])
def test_a_stop_before_a_correction_starts_leaves_pose_and_trims(trim: str) -> None:
    """Once they were NaN after a stop while the drives were being enabled, and in the record."""
    with (
        simulated(tension_trim=trim, axial_stiffness=200e3) as (live, clock),
        open_bench(live.bench_spec, clock) as bench,
    ):
        clock.sleep(0.5)
        for number in range(8):
            if trim == "none":
                bench.robot.hold(preload=520.0, hold=1.0)
            else:
                goal = bench.robot.moved({"x": 0.002}, relative=True)
                bench.robot.move(goal, 0.05, 0.2, wait=False)
            clock.sleep(number * CYCLE)
            bench.stop()
            assert not bench.snapshot.tripped
            assert np.isfinite([one.trim_angle for one in bench.snapshot.winch.values()]).all()
            assert np.isfinite(bench.robot.pose.position).all()
            clock.sleep(0.4)  # as after the release of a key
