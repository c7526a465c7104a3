"""Robot programmes: shipped examples, what is checked before anything moves, and their logs."""

from __future__ import annotations

import textwrap
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from winchkit import find, read_run
from winchkit.bench.bench import Bench
from winchkit.bench.lifecycle import stopped_after
from winchkit.errors import FileError, LimitTripped, MotionError, NotPermitted, UsageError
from winchkit.robot import read_robot, robot_of
from winchkit.robot.bench.planner import Planner
from winchkit.robot.bench.programme import planned_motions, run_robot_programme
from winchkit.schema.bench import LimitSpec
from winchkit.schema.read import read_robot_programme
from winchkit.schema.robot_bench import RobotWiring
from winchkit.schema.robot_programme import PoseSpec, PoseStep, RobotProgramme

EXAMPLES = Path(__file__).parents[3] / "examples"
FOLLOWING = 2e-3
"""Largest lag of a speed-controlled drive on the path, m, at a cycle of 20 ms."""
DEVICE = RobotWiring("winding-device-8", speed=0.2, tension=(60.0, 1000.0))


def planner_of(wiring: RobotWiring) -> Planner:
    robot = robot_of(read_robot(find("profiles", wiring.profile)))
    return Planner(robot, wiring, dict.fromkeys(robot.names, LimitSpec(0.5)))


def test_the_rectangle_of_the_winding_device_is_feasible_and_its_forces_are_continuous() -> None:
    planner = planner_of(DEVICE)
    programme = read_robot_programme(EXAMPLES / "robot-rectangle.toml")
    motions, end = planned_motions(planner, programme, planner.robot.home)
    moves = [one for one in motions if not isinstance(one, float)]
    assert [one.path.length for one in moves[1:5]] == pytest.approx([0.4, 0.43, 0.4, 0.43])
    assert max(one.speed.max() for one in moves) <= 0.05 + 1e-9
    assert end.position == pytest.approx(planner.robot.home.position)
    for one in moves:
        assert 60.0 <= one.force.min() <= one.force.max() <= 1000.0
        assert np.abs(np.diff(one.force, axis=0)).max() < 2.0, "N in 20 ms"


@pytest.mark.parametrize("name", ["robot-star", "robot-poses"])
def test_shipped_examples_are_feasible_for_the_robot_of_cabtive(name: str) -> None:
    planner = planner_of(RobotWiring("cabtive", speed=0.2, tension=(5.0, 300.0)))
    motions, _ = planned_motions(
        planner, read_robot_programme(EXAMPLES / f"{name}.toml"), planner.robot.home
    )
    assert len(motions) > 5


def test_a_limit_that_a_later_step_exceeds_is_found_with_its_step() -> None:
    planner = planner_of(DEVICE)
    steps = (PoseStep(to=PoseSpec(x=0.1)), PoseStep(to=PoseSpec(z=1.1)))
    programme = RobotProgramme("high", steps, 0.05)
    with pytest.raises(NotPermitted, match=r"high, step 2: at \d+ mm of the path.*no cable forces"):
        planned_motions(planner, programme, planner.robot.home)
    with pytest.raises(NotPermitted, match=r"speed 0\.5 m/s of the platform"):
        planned_motions(planner, replace(programme, speed=0.5), planner.robot.home)


@pytest.mark.slow
def test_a_programme_is_played_and_logged_once_per_repeat(bench: Bench, tmp_path: Path) -> None:
    steps = (
        PoseStep(to=PoseSpec(x=0.03), blend=0.01),
        PoseStep(to=PoseSpec(x=0.03, y=0.03)),
        PoseStep(hold=0.3),
        PoseStep(to=PoseSpec(x=0.0, y=0.0)),
    )
    programme = RobotProgramme("corner", steps, 0.1, frame="home", repeat=2)
    written = run_robot_programme(bench, programme, tmp_path)
    assert [path.name for path in written] == ["corner-1.csv", "corner-2.csv"]
    robot = bench.robot.robot
    ends = []
    for path in written:
        run = read_run(path)
        angles = np.array([run.channels[f"{name}.motor_angle"].values for name in robot.names]).T
        place = robot.poses_at(angles[::5]).pose.position - robot.home.position
        assert place[:, 0].max() == pytest.approx(0.03, abs=FOLLOWING)
        assert place[:, 1].max() == pytest.approx(0.03, abs=FOLLOWING)
        ends.append(angles[-1])
    assert ends[0] == pytest.approx(ends[1], abs=2e-3), "repeats do not drift"
    assert bench.snapshot.at_rest
    with pytest.raises(UsageError, match="holds an earlier run of 'corner'"):
        run_robot_programme(bench, programme, tmp_path)


def test_a_quick_stop_during_a_hold_ends_the_programme(bench: Bench, tmp_path: Path) -> None:
    """The platform stands then, so that the stop ends no motion; the next one must not begin."""
    steps = (PoseStep(by=PoseSpec(x=0.002)), PoseStep(hold=2.0), PoseStep(by=PoseSpec(x=0.05)))
    rested: list[list[float]] = []

    def angles() -> list[float]:
        return [winch.motor_angle for winch in bench.snapshot.winch.values()]

    def stop(_repeat: int, number: int) -> None:
        if number == 2:
            bench.stop_now()
            rested.append(angles())

    with pytest.raises(MotionError, match="stopped the bench between two motions"):
        run_robot_programme(bench, RobotProgramme("held", steps, 0.1), tmp_path, progress=stop)
    bench.clock.sleep(0.5)
    assert bench.snapshot.at_rest
    assert rested == [pytest.approx(angles(), abs=1e-3)]
    assert len(read_run(tmp_path / "held-1.csv").time) > 5, "the log until then is kept"


def test_faults_of_a_robot_programme(tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(
        textwrap.dedent(
            """\
            schema = 1
            kind = "robot-programme"
            speed = "0.1 m/s"
            [[step]]
            to = { x = "1 m" }
            hold = "1 s"
            [[step]]
            to = { x = "1 m" }
            blend = "1 mm"
            [[step]]
            hold = "1 s"
            [[step]]
            to = { q = "1 m" }
            [[step]]
            by = {}
            """
        )
    )
    with pytest.raises(FileError) as caught:
        read_robot_programme(path)
    words = str(caught.value)
    assert "exactly one of to, by, hold; it has to and hold" in words
    assert "q" in words
    assert "at least one of x, y, z" in words


@pytest.mark.parametrize("error", [LimitTripped("no feedback"), KeyboardInterrupt()])
def test_the_cause_is_raised_where_the_stop_after_it_fails_too(error: BaseException) -> None:
    """A dead drive trips the bench and does not come to rest afterwards."""
    stops = []

    def stop() -> None:
        stops.append(1)
        raise MotionError("winch 3 did not come to rest within 5 s")

    with pytest.raises(type(error)), stopped_after(stop):
        raise error
    with pytest.raises(MotionError, match="come to rest"), stopped_after(stop):
        pass
    assert len(stops) == 2
