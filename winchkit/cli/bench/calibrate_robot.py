"""``winchkit calibrate --bench`` and ``--sim``: the robot is driven to poses, which are fitted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from winchkit.cli.core.messages import note
from winchkit.errors import UsageError

if TYPE_CHECKING:
    from winchkit.bench.bench import Bench
    from winchkit.bench.robot.computation import Computation
    from winchkit.bench.robot.self_calibration import PoseVolume, SelfCalibration
    from winchkit.bench.robot.tracker import Tracker
    from winchkit.calibration.robot.calibrate import Options
    from winchkit.cli.core.terminal import ProgressCallback
    from winchkit.runs.run import Run
    from winchkit.schema.bench import BenchSpec

__all__ = ["PoseSeries", "pose_names"]

_INSTRUMENTS = 0.5
"""Time in which every instrument of a simulated bench has been read, s."""


def pose_names(output: Path) -> dict[str, Path]:
    """Files of the measured poses beside the written profile, by run."""
    return {name: output.with_name(f"{output.stem}-{name}.csv") for name in ("fit", "validation")}


@dataclass(frozen=True)
class PoseSeries:
    """Poses to drive to, measure and fit; they are written as they are measured."""

    robot: str
    """Profile that is calibrated."""
    output: Path
    poses: int
    validation: int
    volume: PoseVolume
    options: Options
    accuracy: float | None
    """m."""
    progress: ProgressCallback

    def on_bench(self, path: str) -> SelfCalibration:
        """Open the bench as its owner, and calibrate its robot."""
        from winchkit.bench.open import open_bench
        from winchkit.bench.remote.identity import client_name
        from winchkit.bench.robot.computation import ComputationProcess
        from winchkit.schema.read import read_bench

        spec = read_bench(path)
        self._check(spec, path)
        keep = self._files()
        with (
            ComputationProcess() as compute,
            open_bench(path, name=client_name("calibrate"), realtime="try") as opened,
        ):
            tracker = opened.tracker
            assert tracker is not None, "the bench file declares it"
            return self._calibrated(opened, tracker, keep, compute)

    def simulated(self, name: str) -> SelfCalibration:
        """Calibrate a simulated robot, by the same loop and frames in simulated time."""
        from winchkit.bench.open import open_bench
        from winchkit.bench.robot.tracker import Tracker
        from winchkit.catalog import find
        from winchkit.schema.read import read_simbench
        from winchkit.sim.clock.simulated_clock import SimulatedClock
        from winchkit.sim.live.bench import LiveBench

        sim = read_simbench(find("sim", name))
        self._check(sim.bench, name)
        keep = self._files()
        clock = SimulatedClock()
        with LiveBench(sim, simulated_time=clock) as live:
            assert live.robot is not None, "the bench has a robot"
            tracker = Tracker(clock.now)
            live.robot.on_pose = tracker.receive
            with open_bench(live.bench_spec, clock) as opened:
                clock.sleep(_INSTRUMENTS)
                return self._calibrated(opened, tracker, keep)

    def _calibrated(
        self,
        bench: Bench,
        tracker: Tracker,
        keep: Callable[[Run], None],
        compute: Computation | None = None,
    ) -> SelfCalibration:
        from winchkit.bench.robot.computation import at_once
        from winchkit.bench.robot.self_calibration import self_calibrated

        return self_calibrated(
            bench,
            tracker,
            poses=self.poses,
            validation=self.validation,
            volume=self.volume,
            options=self.options,
            accuracy=self.accuracy,
            compute=compute or at_once,
            progress=self.progress,
            keep=keep,
        )

    def _check(self, spec: BenchSpec, name: str) -> None:
        """Raise UsageError unless the bench moves this robot, seen by a tracker."""
        from winchkit.catalog import find

        if spec.robot is None or spec.robot.tracker is None:
            raise UsageError(
                f"{name}: declares no robot with a tracker; write [robot] with tracker = "
                '{ listen = "udp://127.0.0.1:5100" } (docs/howto/tracker.md)'
            )
        own = find("profiles", spec.robot.profile, beside=spec.path or None)
        if own.resolve() != find("profiles", self.robot).resolve():
            raise UsageError(f"ROBOT is '{self.robot}', the bench moves '{spec.robot.profile}'")

    def _files(self) -> Callable[[Run], None]:
        """What writes the measured poses; raises UsageError where older ones would be lost."""
        from winchkit.runs.writer import write_run

        files = pose_names(self.output)
        held = [path for path in files.values() if path.exists()]
        if held:
            raise UsageError(
                f"{held[0]} holds poses of an earlier calibration; name another profile with -o, "
                "or move the file"
            )

        def keep(run: Run) -> None:
            write_run(run, files[run.name])
            note(f"written: {files[run.name]} ({len(run.time)} poses)")

        return keep
