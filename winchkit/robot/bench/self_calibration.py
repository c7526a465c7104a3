"""Calibration of a robot by its own bench: drive to poses, measure at rest, fit, validate.

The procedure of the CABTIVE paper (Lessanibahri et al., section IV). Poses are drawn at random in a
box about home; one that the cables cannot hold within the limits is drawn again. Poses of the
validation are never used in the fit.

Cables are moved by their lengths, so that errors of the geometry change the cable forces, the more
the farther the platform is from where these were right: 1 mm of a steel cable of 20 N/mm are 20 N.
Hence the first poses are near home, the geometry is fitted to them, motions are planned with the
fitted robot from then on, and the preload of the beginning is restored by the load cells after each
of these fits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np

from winchkit.arguments import ProgressCallback, no_progress, require_type
from winchkit.arrays import Array
from winchkit.bench.lifecycle import stopped_after
from winchkit.bench.tracker import TrackerReceiver, mean_pose
from winchkit.catalog import find
from winchkit.errors import NotPermitted, RunError, UsageError
from winchkit.model.rotation import angles_of, rotation_of
from winchkit.robot.bench.computation import Computation, at_once
from winchkit.robot.bench.path import Waypoint
from winchkit.robot.bench.planner import Planner, moved
from winchkit.robot.bench.trajectory import PlatformTrajectory
from winchkit.robot.bench.wiring import robot_of_bench
from winchkit.robot.calibration.calibrate import Calibrated, calibrate
from winchkit.robot.calibration.options import Options
from winchkit.robot.calibration.pose_design import next_poses
from winchkit.robot.calibration.prediction import rms
from winchkit.robot.calibration.profile import Provenance, write_calibrated
from winchkit.robot.files.poses import read_poses
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.robot import Robot, robot_of
from winchkit.runs.run import Channel, Run
from winchkit.schema.bench import BenchSpec
from winchkit.schema.profiles.robot import COORDINATES, RobotProfile
from winchkit.schema.read import read_robot

if TYPE_CHECKING:
    from winchkit.bench.bench import Bench

_TRIES = 40
"""Draws of one pose, of which one is to be within the limits."""
_CHANNELS = tuple(f"platform_{axis}" for axis in COORDINATES)
_UNITS = ("m", "m", "m", "rad", "rad", "rad")
_POLL = 0.05
"""s: 20 readings of all instruments in a dwell of 1 s."""
_STAGE = 10
"""Poses before the geometry is fitted for the motions that follow: as many as a fit needs."""
_STAGES = 3
"""Parts of the volume: the first ten poses within a third of its width, ten within two thirds. The
forces of CABTIVE with points that are 5 mm wrong differ by 10 to 22 N (standard deviation) in the
whole volume, for a mean of 40 N: 3 to 7 N in a third."""
_ROUNDS = 6
"""Times that poses are added to reach a wanted accuracy."""


@dataclass(frozen=True)
class PoseVolume:
    """Volume about home in which poses are drawn, and how each is measured."""

    half_width: float = 0.075
    """Along each axis, m; CABTIVE: 75 mm."""
    half_turn: float = 0.131
    """About each axis, rad; CABTIVE: 7.5°."""
    settle: float = 0.5
    """Time at rest before a measurement, s."""
    dwell: float = 0.5
    """Time over which it is averaged, s."""


@dataclass(frozen=True)
class SelfCalibration:
    """Result of :func:`self_calibrated`."""

    calibrated: Calibrated
    """Estimates, prediction errors before and after, warnings."""
    fit: Run
    """Poses that were fitted, a row each."""
    validation: Run
    """Poses of the validation."""

    @property
    def held_out(self) -> tuple[float, float]:
        """Position error of the validation before and after, rms, m."""
        found = self.calibrated
        return rms(found.validation_before.distance), rms(found.validation_after.distance)


def self_calibrated(
    bench: Bench,
    tracker: TrackerReceiver,
    *,
    poses: int = 60,
    validation: int = 20,
    volume: PoseVolume | None = None,
    options: Options | None = None,
    accuracy: float | None = None,
    seed: int = 0,
    compute: Computation = at_once,
    progress: ProgressCallback = no_progress,
    keep: Callable[[Run], None] = lambda _run: None,
) -> SelfCalibration:
    """Calibrate the robot of an open bench.

    Parameters
    ----------
    bench : Bench
        With a robot at home or anywhere in its workspace; its operator watches.
    tracker : TrackerReceiver
        Receives poses of the platform.
    poses, validation : int
        Number of poses to fit, and of poses that are never fitted.
    volume : PoseVolume, optional
        Where, and how long each is measured.
    options : Options, optional
        Effects and noise, as of :func:`winchkit.calibrate`.
    accuracy : float, optional
        Held-out position error, m: poses of most information are added, a sixth of ``poses`` at a
        time, until it is reached, six times at most.
    seed : int
        Of the drawn poses.
    compute : Computation, optional
        Where motions are planned and poses fitted; in real time a
        :class:`~winchkit.robot.bench.computation.ComputationProcess`, so that the control loop has
        its interpreter for itself.
    progress : callable, optional
        Called with what is done and the share of the poses.
    keep : callable, optional
        Called with the run ``fit`` or ``validation`` after each of its poses, so that nothing is
        lost where the calibration is stopped.

    Returns
    -------
    SelfCalibration
        The calibration and the measured poses.

    Raises
    ------
    UsageError
        For fewer than ten poses, or none to validate.
    NotPermitted
        Where no pose of the volume is within the limits.
    MotionError, NoReply
        Whatever stops a motion, a quick stop between two of them included; a tracker that sends
        nothing.
    """
    require_type(tracker, TrackerReceiver, "tracker")
    if poses < 10 or validation < 1:
        raise UsageError(
            f"{poses} poses to fit and {validation} to validate: at least 10 and 1 are needed"
        )
    volume = volume or PoseVolume()
    random = np.random.default_rng(seed)
    driver = _Driver(bench, tracker, volume, compute)
    session = f"calibrate {datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}"
    total = poses + validation
    done = 0

    def measured(run: Run) -> None:
        nonlocal done
        done += 1
        keep(run)
        what = f"measuring pose {min(done + 1, total)} of {total}"
        progress(what if done <= total else f"{done - total} poses added", min(1.0, done / total))

    with stopped_after(bench.stop):
        progress(f"measuring pose 1 of {total}", 0.0)
        fit: Run | None = None
        for count, share in _stages(poses):
            if fit is not None:
                progress("fitting the geometry for the motions that follow", None)
                driver.refine(fit, options)
            rows = driver.drawn(random, count, share)
            fit = recorded_poses(rows, bench, "fit", measured, first=fit, session=session)
        assert fit is not None, "there is at least one stage"
        held = recorded_poses(
            driver.drawn(random, validation), bench, "validation", measured, session=session
        )
        progress("fitting", None)
        found = driver.fitted(fit, held, options)
        for _ in range(_ROUNDS if accuracy else 0):
            error = rms(found.validation_after.distance)
            if error <= (accuracy or 0.0):
                break
            progress(f"adding poses: {error * 1e3:.3g} mm of {(accuracy or 0) * 1e3:g} mm", None)
            more = driver.proposed(found, max(1, poses // 6))
            fit = recorded_poses(more, bench, "fit", measured, first=fit, session=session)
            found = driver.fitted(fit, held, options)
    return SelfCalibration(found, fit, held)


def _stages(poses: int) -> list[tuple[int, float]]:
    """Number of poses and share of the volume, until all of it is used."""
    before = min(_STAGES, poses // _STAGE) - 1
    early = [(_STAGE, (k + 1) / _STAGES) for k in range(before)]
    return [*early, (poses - _STAGE * before, 1.0)]


def recorded_poses(
    rows: Iterator[Array],
    bench: Bench,
    name: str,
    keep: Callable[[Run], None],
    *,
    first: Run | None = None,
    session: str = "",
) -> Run:
    """Measure poses, a row each, beside those of ``first``."""
    lines = bench.robot.robot.names
    units = {
        **{f"{line}.motor_angle": "rad" for line in lines},
        **{f"{line}.tension": "N" for line in lines},
        **dict(zip(_CHANNELS, _UNITS, strict=True)),
    }
    values: list[Array] = []
    if first is not None:
        values.extend(np.column_stack([first.time, *(first[channel] for channel in units)]))
    run = first
    for row in rows:
        values.append(row)
        table = np.array(values)
        channels = {
            channel: Channel(table[:, 1 + i], unit)
            for i, (channel, unit) in enumerate(units.items())
        }
        run = Run(name, table[:, 0], channels, {"session": session} if session else {})
        keep(run)
    if run is None:
        raise RunError(f"{name}: no pose was measured")
    return run


class _Driver:
    """Moves the platform from pose to pose and measures each at rest."""

    def __init__(
        self, bench: Bench, tracker: TrackerReceiver, volume: PoseVolume, compute: Computation
    ) -> None:
        self.bench, self.tracker, self.volume = bench, tracker, volume
        self._compute = compute
        self._planner = bench.robot.planner
        self._here = bench.robot.pose
        self._preload: Array | None = None
        self._deviation = bench.robot.force_deviation()
        self._stops = bench.stops
        self._began = bench.clock.now()

    def refine(self, fit: Run, options: Options | None) -> None:
        """Plan with the robot that fits the poses so far, and restore the preload, where each winch
        has a load cell."""
        found = self._compute(self._look, _refitted, self.bench.spec, fit, options)
        if found is not None:
            self._planner = replace(self._planner, robot=found)
            self._preload = None
            if np.all(np.isfinite(self._deviation)):
                self.bench.robot.trim(keep=self._deviation, hold=True)

    def drawn(self, random: np.random.Generator, count: int, share: float = 1.0) -> Iterator[Array]:
        """Rows of random poses within the limits, in a share of the volume's widths."""
        reach = share * np.repeat([self.volume.half_width, self.volume.half_turn], 3)
        home = self.bench.robot.robot.home
        for _ in range(count):
            for _ in range(_TRIES):
                change = dict(zip(COORDINATES, random.uniform(-reach, reach).tolist(), strict=True))
                if self._go(moved(home, change, relative=True)):
                    break
            else:
                raise NotPermitted(
                    f"none of {_TRIES} poses within {self.volume.half_width * 1e3:g} mm of home is "
                    "within the limits of robot and winches; choose a smaller box, or wider limits"
                )
            yield self._measured()

    def proposed(self, found: Calibrated, count: int) -> Iterator[Array]:
        """Rows of the poses of most information that are within the limits."""
        for pose in self._compute(self._look, next_poses, found, count):
            turned = rotation_of(*pose.angles)[None]
            if self._go(Pose(np.array([pose.position]), turned)):
                yield self._measured()

    def _go(self, goal: Pose) -> bool:
        """Move on a line; False where a limit forbids it."""
        platform = self.bench.robot
        goal = platform.robot.guided(goal)
        planned = self._compute(self._look, _planned, self._planner, goal, self._here)
        if planned is None:
            return False
        for motion in planned:
            self._look()
            self._preload = platform.begin(motion, hold=True, preload=self._preload)
            platform.wait()
        self._here = goal
        return True

    def _measured(self) -> Array:
        bench, volume = self.bench, self.volume
        self._wait(volume.settle)
        begin = bench.clock.now()
        seen: list[tuple[list[float], list[float]]] = []
        while bench.clock.now() < begin + volume.dwell:
            self._wait(_POLL)
            winches = bench.snapshot.winch
            names = bench.robot.robot.names
            seen.append(
                ([winches[n].motor_angle for n in names], [winches[n].tension for n in names])
            )
        wiring = bench.robot.planner.wiring.tracker
        poses = self.tracker.require(begin, wiring.listen if wiring else "the tracker's address")
        pose = mean_pose(poses)
        angles, tension = (np.mean([row[k] for row in seen], axis=0) for k in (0, 1))
        time = [begin - self._began]
        return np.concatenate([time, angles, tension, pose.position, angles_of(pose.rotation)])

    def _wait(self, duration: float) -> None:
        bench = self.bench
        end = bench.clock.now() + duration
        while (left := end - bench.clock.now()) > 0:
            self._look()
            bench.clock.sleep(min(_POLL, left))

    def fitted(self, fit: Run, held: Run, options: Options | None) -> Calibrated:
        """Fit the measured poses."""
        profile = self.bench.robot.robot.profile
        return self._compute(self._look, _fitted, profile, fit, held, options)

    def _look(self) -> None:
        """Raise the error that has stopped the bench since the beginning."""
        self.bench.raise_stop(self._stops)


def _planned(planner: Planner, goal: Pose, start: Pose) -> list[PlatformTrajectory] | None:
    """Motions on a line to a pose; None where a limit forbids it."""
    try:
        return planner.plan([Waypoint(goal.position[0], goal.rotation[0])], start)
    except (NotPermitted, UsageError):
        return None


def _refitted(spec: BenchSpec, fit: Run, options: Options | None) -> Robot | None:
    """The robot of a bench with what fits these poses; None where they do not calibrate it."""
    assert spec.robot is not None, "it moves"
    source = find("profiles", spec.robot.profile, spec.path or None)
    found = _fitted(read_robot(source), fit, None, options)
    if found.refusal:
        return None
    with TemporaryDirectory() as folder:
        path = Path(folder) / source.name
        write_calibrated(source, found, path, Provenance([fit.name], datetime.now(UTC).date()))
        return robot_of_bench(replace(spec, robot=replace(spec.robot, profile=str(path))))


def _fitted(
    profile: RobotProfile, fit: Run, held: Run | None, options: Options | None
) -> Calibrated:
    """Fit with the tracker's frame unknown."""
    tracker = profile.instrument.tracker
    unknown = replace(tracker, frame="unknown")
    profile = replace(profile, instrument=replace(profile.instrument, tracker=unknown))
    validation = None if held is None else read_poses([held], profile)
    return calibrate(robot_of(profile), read_poses([fit], profile), validation, options)
