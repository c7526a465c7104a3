"""Executes a robot programme: everything is planned and checked first, then moved and logged."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from winchkit.arrays import Array
from winchkit.bench.bench import Bench
from winchkit.bench.lifecycle import stopped_after
from winchkit.errors import NotPermitted, RunError, UsageError
from winchkit.robot.bench.path import Waypoint
from winchkit.robot.bench.planner import Planner, coordinates_of, moved
from winchkit.robot.bench.platform import Platform
from winchkit.robot.bench.trajectory import PlatformTrajectory
from winchkit.robot.geometry.kinematics import Pose
from winchkit.schema.robot_programme import PoseStep, RobotProgramme

_POLL = 0.02
"""s: a hold ends that soon after a stop."""
Motions = list[PlatformTrajectory | float]
"""Motions from stop to stop, and holds (s)."""


def programme_files(programme: RobotProgramme, folder: str | Path, suffix: str) -> list[Path]:
    """Files that a programme writes, one per repeat."""
    numbers = range(1, programme.repeat + 1)
    return [Path(folder) / f"{programme.name}-{n}{suffix}" for n in numbers]


def planned_motions(
    planner: Planner, programme: RobotProgramme, start: Pose
) -> tuple[Motions, Pose]:
    """Plan one repeat, with the pose at its end, and compare it with all limits; nothing moves.
    Raises NotPermitted, with the number of the step, for a limit that would be exceeded."""
    out: Motions = []
    here = at = start
    group: list[Waypoint] = []
    for number, step in enumerate(programme.step, start=1):
        if step.hold is not None:
            out.append(step.hold)
            continue
        goal = _goal(planner, programme, step, at)
        via = None if step.via is None else _place(planner, programme, step)
        group.append(Waypoint(goal.position[0], goal.rotation[0], via, step.blend or 0.0))
        at = goal
        if step.blend is None:
            try:
                out += planner.plan(group, here, programme.speed, programme.acceleration)
            except (UsageError, NotPermitted) as error:
                raise type(error)(f"{programme.name}, step {number}: {error}") from error
            here, group = goal, []
    return out, here


def run_robot_programme(
    bench: Bench,
    programme: RobotProgramme,
    folder: str | Path,
    *,
    suffix: str = ".csv",
    progress: Callable[[int, int], None] = lambda _repeat, _number: None,
    check: Callable[[], None] = lambda: None,
    replace_files: bool = False,
) -> list[Path]:
    """Run a programme of the platform, and log one run per repeat; ``check`` is called before each
    motion and every 20 ms of a hold, and ends the programme by what it raises.

    Raises UsageError and NotPermitted before any motion, for a file that is not to be replaced and
    a limit that would be exceeded; MotionError for what stops a motion, with the rows until then
    kept. With repeats the platform first moves, not logged, to the pose at which a repeat ends.
    """
    files = programme_files(programme, folder, suffix)
    held = [path for path in files if path.exists()]
    if held and not replace_files:
        raise UsageError(
            f"{held[0]} holds an earlier run of '{programme.name}'; name another folder, or replace"
        )
    bench.require_motion()
    platform = bench.robot
    start = platform.pose
    planner = platform.planner
    first, end = planned_motions(planner, programme, start)
    approach: Motions = []
    if programme.repeat > 1:
        there = Waypoint(end.position[0], end.rotation[0])
        approach = [*planner.plan([there], start, programme.speed, programme.acceleration)]
        first, _ = planned_motions(planner, programme, end)
    Path(folder).mkdir(parents=True, exist_ok=True)
    execution = _PlatformExecution(bench, platform, progress, check)
    with stopped_after(bench.stop):
        execution.play(0, approach)
        for repeat, path in enumerate(files, start=1):
            about = {"programme": programme.name, "repeat": str(repeat)}
            with bench.log(path, about, replace=replace_files) as recorder:
                execution.play(repeat, first)
            if recorder.rows == 0:
                raise RunError(f"{path}: no reading came during the run; check the sensors")
    return files


class _PlatformExecution:
    """The motions of a programme, one after another, with the drives enabled between them."""

    def __init__(
        self,
        bench: Bench,
        platform: Platform,
        progress: Callable[[int, int], None],
        check: Callable[[], None],
    ) -> None:
        self._bench, self._platform, self._progress = bench, platform, progress
        self._check = check
        self._preload: Array | None = None
        self._stops = bench.stops

    def play(self, repeat: int, motions: Motions) -> None:
        for number, motion in enumerate(motions, start=1):
            self._progress(repeat, number)
            if isinstance(motion, float):
                self._hold(motion)
                continue
            self._require_going()
            self._preload = self._platform.begin(motion, hold=True, preload=self._preload)
            self._platform.wait()

    def _require_going(self) -> None:
        """Raise what has stopped the bench, or ends the programme."""
        self._bench.raise_stop(self._stops)
        self._check()

    def _hold(self, duration: float) -> None:
        clock = self._bench.clock
        end = clock.now() + duration
        while (left := end - clock.now()) > 0:
            self._require_going()
            clock.sleep(min(_POLL, left))


def _goal(planner: Planner, programme: RobotProgramme, step: PoseStep, at: Pose) -> Pose:
    """Pose of a step in the base frame."""
    if step.by is not None:
        return moved(at, step.by.given, relative=True)
    assert step.to is not None, "the reader has checked it"
    given = step.to.given
    if programme.frame == "home":
        home = coordinates_of(planner.robot.home)
        given = {name: value + home[name] for name, value in given.items()}
    return moved(at, given, relative=False)


def _place(planner: Planner, programme: RobotProgramme, step: PoseStep) -> Array:
    """Position on the arc of a step, (3,), m, base frame."""
    assert step.via is not None, "asked for with an arc only"
    place = np.array([step.via.x, step.via.y, step.via.z])
    return place + planner.robot.home.position[0] if programme.frame == "home" else place
