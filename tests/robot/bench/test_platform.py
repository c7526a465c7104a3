"""A robot's platform moved by eight simulated winches, in simulated time.

The drives are simulated independently of the model; where the platform is follows from their motor
angles by forward kinematics.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from winchkit.arrays import Array
from winchkit.bench.bench import Bench
from winchkit.bench.control.loop import Callback
from winchkit.bench.control.snapshot import BenchSnapshot, Phase
from winchkit.errors import MotionError, NotPermitted, UsageError
from winchkit.model.rotation import rotation_by
from winchkit.robot import Pose, PosesFound, Robot
from winchkit.robot.bench.path import Waypoint
from winchkit.robot.bench.platform import Platform
from winchkit.robot.bench.platform_pose import PlatformPose
from winchkit.robot.geometry.forward import distance
from winchkit.schema.bench import BenchSpec
from winchkit.sim.live.bench import LiveBench

NAMES = "12345678"


def _appended(seen: list[BenchSnapshot]) -> Callback:
    def take(snapshot: BenchSnapshot) -> None:
        seen.append(snapshot)

    return take


def errors(platform: Platform, snapshots: list[BenchSnapshot], start: Array, end: Array) -> Array:
    """Distances from the line of the poses by the motor angles, m."""
    names = platform.robot.names
    angles = np.array([[s.winch[name].motor_angle for name in names] for s in snapshots])
    places = platform.robot.poses_at(angles).pose.position
    along = (end - start) / np.linalg.norm(end - start)
    off = places - start
    return np.asarray(np.linalg.norm(off - np.outer(off @ along, along), axis=1))


@pytest.mark.slow
def test_the_platform_goes_to_a_pose_on_a_line(bench: Bench) -> None:
    platform = bench.robot
    start = platform.pose
    goal = platform.moved({"x": 0.06, "z": 0.05, "pitch": 0.05}, relative=True)
    seen: list[BenchSnapshot] = []
    remove = bench.on_cycle(_appended(seen))
    platform.move(goal)
    remove()
    there = platform.pose
    assert there.position == pytest.approx(goal.position, abs=2e-4)
    assert there.rotation == pytest.approx(goal.rotation, abs=2e-3)
    assert errors(platform, seen, start.position[0], goal.position[0]).max() < 2e-3
    assert bench.snapshot.at_rest


def test_a_stop_ends_on_the_path_and_all_cables_come_to_rest_together(bench: Bench) -> None:
    platform = bench.robot
    start = platform.pose
    goal = platform.moved({"x": 0.08, "y": 0.06}, relative=True)
    platform.move(goal, wait=False)
    bench.clock.sleep(0.9)
    seen: list[BenchSnapshot] = []
    remove = bench.on_cycle(_appended(seen))
    bench.stop()
    remove()
    assert errors(platform, seen, start.position[0], goal.position[0]).max() < 2e-3
    left = np.linalg.norm(platform.pose.position - goal.position)
    assert 0.01 < left < 0.09, "it stopped on the way"
    velocity = np.array([[s.winch[n].motor_velocity for n in NAMES] for s in seen])
    fastest = np.abs(velocity[0]).max()
    shares = velocity / velocity[0]
    moving = np.abs(velocity).max(axis=1) > 0.2 * fastest
    quick = np.abs(velocity[0]) > 0.3 * fastest
    assert np.ptp(shares[moving][:, quick], axis=1).max() < 0.15, "in the same proportion"
    with pytest.raises(MotionError, match=r"was stopped by .* before its motion was finished"):
        platform.wait()


def test_what_the_cables_cannot_hold_is_refused_before_anything_moves(bench: Bench) -> None:
    before = bench.snapshot
    far = bench.robot.moved({"x": 0.5}, relative=True)
    with pytest.raises(NotPermitted, match=r"at \d+ mm of the path.*no cable forces.*cable \S+ "):
        bench.robot.move(far)
    with pytest.raises(NotPermitted, match=r"speed 0\.2 m/s of the platform"):
        bench.robot.move(bench.robot.pose, 0.2)
    assert bench.snapshot.at_rest
    assert bench.snapshot.winch["1"].motor_angle == pytest.approx(
        before.winch["1"].motor_angle, abs=1e-3
    )


BAD: list[Any] = ["0.05", math.nan, math.inf, 0.0, -0.1, True, [0.1]]
CALLS: dict[str, Callable[[Platform, Any], object]] = {
    "speed": lambda p, x: p.move(p.robot.home, x),
    "acceleration": lambda p, x: p.move(p.robot.home, None, x),
    "duration": lambda p, x: p.trim(duration=x),
    "stiffness": lambda p, x: p.trim(axial_stiffness=x),
}


def test_what_is_no_number_or_no_pose_is_refused_before_anything_is_sent(bench: Bench) -> None:
    platform, seen = bench.robot, list[BenchSnapshot]()
    remove = bench.on_cycle(_appended(seen))
    for call in CALLS.values():
        for value in BAD:
            with pytest.raises(UsageError, match=r"pass a number|is not a"):
                call(platform, value)
    for change in (math.nan, math.inf, "0.1", None):
        with pytest.raises(UsageError, match=r"pass a number|is not a finite"):
            platform.moved({"x": change}, relative=True)  # type: ignore[dict-item] # the test's
    here = platform.pose
    goal = Pose(np.where([[True, False, False]], math.nan, here.position), here.rotation)
    with pytest.raises(UsageError, match="not finite"):
        platform.move(goal)
    for nothing in (None, "home", here.position):
        with pytest.raises(UsageError, match=r"goal is .*pass a Pose"):
            platform.move(nothing)  # type: ignore[arg-type] # what the test is about
    with pytest.raises(UsageError, match="keep has numbers that are not finite"):
        platform.trim(keep=np.full(8, math.nan))
    bench.clock.sleep(0.3)
    remove()
    assert {one.phase for snapshot in seen for one in snapshot.winch.values()} == {Phase.DISABLED}


@pytest.mark.parametrize("call", ["move", "trim", "wait"])
def test_what_waits_is_refused_in_a_callback_before_it_begins(bench: Bench, call: str) -> None:
    platform = bench.robot
    goal = platform.moved({"x": 0.02}, relative=True)
    raised: list[Exception | None] = []

    def function(_snapshot: BenchSnapshot) -> None:
        if not raised:
            try:
                {"move": lambda: platform.move(goal), "trim": platform.trim, "wait": platform.wait}[
                    call
                ]()
                raised.append(None)
            except UsageError as error:
                raised.append(error)

    remove = bench.on_cycle(function)
    bench.clock.sleep(0.3)
    remove()
    assert f"{call} waits for the control loop" in str(raised[0])
    assert not platform.moving
    assert bench.snapshot.at_rest


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        ({"speed": 0.02}, "speed of cable 3 is .* limits.speed of its winch is 0.02 m/s"),
        ({"acceleration": 0.01}, "acceleration of cable 3 .* 0.01 m/s\\^2"),
        ({"length": (0.0, 0.2)}, "cable 3 would be .* m long, limits.length of its winch is 0 m"),
    ],
)
def test_limits_of_a_winch_hold_along_the_path(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, limits: dict[str, object], words: str
) -> None:
    platform = bench.robot
    own = replace(platform.planner.limits["3"], **limits)  # type: ignore[arg-type] # by name
    monkeypatch.setitem(platform.planner.limits, "3", own)
    goal = platform.moved({"x": 0.06, "y": 0.06}, relative=True)
    with pytest.raises(NotPermitted, match=words):
        platform.planner.plan([Waypoint(goal.position[0], goal.rotation[0])], platform.pose)


def test_forces_of_the_plan_are_within_limits_and_balance_the_platform(bench: Bench) -> None:
    platform = bench.robot
    goal = platform.moved({"x": 0.06, "y": -0.05, "z": 0.03}, relative=True)
    (planned,) = platform.planner.plan(
        [Waypoint(goal.position[0], goal.rotation[0])], platform.pose
    )
    low, high = platform.planner.wiring.tension
    assert planned.force.min() >= low - 1e-6
    assert planned.force.max() <= high + 1e-6
    structure, mass = platform.robot.structure(planned.pose), platform.robot.platform.mass
    force = np.einsum("kij,kj->ki", structure, planned.force)[:, :3]
    expected = mass * (planned.motion.acceleration[:, :3] + np.array([0.0, 0.0, 9.80665]))
    assert force == pytest.approx(expected, abs=1e-3)
    assert np.abs(np.diff(planned.force, axis=0)).max() < 10.0, "forces are continuous"


@pytest.mark.parametrize("fault", ["over-current", "enable input open"])
def test_a_lost_drive_makes_all_others_quick_stop_in_one_cycle(
    live: LiveBench, bench: Bench, fault: str
) -> None:
    platform = bench.robot
    platform.move(platform.moved({"x": 0.08}, relative=True), wait=False)
    bench.clock.sleep(0.6)
    phases: list[set[Phase]] = []
    bench.loop.samplers.append(
        lambda seen: phases.append({seen.winch[n].phase for n in NAMES if n != "4"})
    )
    live.inject("4.servo", fault)
    with pytest.raises(MotionError, match="winch 4"):
        platform.wait()
    bench.clock.sleep(0.3)
    bench.loop.samplers.pop()
    after = [seen for seen in phases if Phase.STOPPING in seen]
    assert after, "a quick stop, no ramp"
    assert Phase.MOVING not in after[0], "all of them in the cycle in which the first stops"
    live.inject("4.servo", "recover")
    bench.wait_at_rest(NAMES)
    with pytest.raises(MotionError):
        platform.move(platform.moved({"x": -0.02}, relative=True))
    bench.reset()


def test_cables_that_fit_no_pose_are_refused(bench: Bench) -> None:
    bench.winch["2"].move_by(wind_in=0.09)
    with pytest.raises(NotPermitted, match="fit no pose: cable"):
        _ = bench.robot.pose
    bench.winch["2"].move_by(pay_out=0.09)


def test_lengths_that_fit_two_poses_move_nothing(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = Robot.poses_at

    def twofold(robot: Robot, *given: Any, **options: Any) -> PosesFound:
        found = plain(robot, *given, **options)
        turned = rotation_by(np.array([[0.5, 0.0, 0.0]])) @ found.pose.rotation
        return replace(found, pose=Pose(found.pose.position, turned), other=found.pose)

    platform = bench.robot
    goal = platform.moved({"x": 0.02}, relative=True)
    monkeypatch.setattr(platform, "_last", None)
    monkeypatch.setattr(Robot, "poses_at", twofold)
    with pytest.raises(NotPermitted, match="fit two poses of the platform that the cables can"):
        platform.move(goal)
    assert bench.snapshot.at_rest


def test_the_pose_follows_a_motion_along_its_path(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beyond the distance up to which it continues from the pose found last; cables are elastic."""
    searched: list[PosesFound] = []
    monkeypatch.setattr(PlatformPose, "_require_one", lambda _self, found: searched.append(found))
    before = bench.robot.pose
    for step in (0.12, -0.12):
        goal = bench.robot.moved({"x": step}, relative=True)
        bench.robot.move(goal)
        assert distance(bench.robot.pose, goal)[0] < 0.01
    assert distance(bench.robot.pose, before)[0] < 0.01
    assert not searched


def test_a_bench_without_robot_has_no_platform(opened: Bench) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(opened, "_platform", None)
        with pytest.raises(UsageError, match=r"declares no robot; write a table \[robot\]"):
            _ = opened.robot


def test_winches_of_a_robot_have_their_cables_length_at_home(opened: Bench) -> None:
    assert isinstance(opened.spec, BenchSpec)
    robot = opened.robot.robot
    assert [line.profile.reference.cable_length for line in robot.lines] == pytest.approx(
        robot.home_length
    )
