"""``winchkit calibrate --bench`` and ``--sim``: the robot is driven to poses, which are fitted."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from winchkit.cli.core.messages import note, suggest_next
from winchkit.errors import UsageError

if TYPE_CHECKING:
    from winchkit.arguments import ProgressCallback
    from winchkit.bench.bench import Bench
    from winchkit.robot.bench.computation import Computation
    from winchkit.robot.bench.self_calibration import PoseVolume, SelfCalibration
    from winchkit.robot.calibration.options import Options
    from winchkit.runs.run import Run
    from winchkit.schema.bench import BenchSpec

_FEWEST = 10
"""Poses from which a fit of those of a stopped calibration is suggested."""


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
        from winchkit.robot.bench.computation import ComputationProcess
        from winchkit.schema.read import read_bench

        spec = read_bench(path)
        self._check(spec, path)
        with (
            self._kept() as keep,
            ComputationProcess() as compute,
            open_bench(path, name=client_name("calibrate"), realtime="try") as opened,
        ):
            return self._calibrated(opened, keep, compute)

    def simulated(self, name: str) -> SelfCalibration:
        """Calibrate a simulated robot, by the same loop and frames in simulated time."""
        from winchkit.catalog import find
        from winchkit.robot.cli.simulated import simulated_robot
        from winchkit.schema.read import read_simbench

        sim = read_simbench(find("sim", name))
        self._check(sim.bench, name)
        with self._kept() as keep, simulated_robot(sim) as opened:
            return self._calibrated(opened, keep)

    def _calibrated(
        self,
        bench: Bench,
        keep: Callable[[Run], None],
        compute: Computation | None = None,
    ) -> SelfCalibration:
        from winchkit.robot.bench.computation import at_once
        from winchkit.robot.bench.self_calibration import self_calibrated

        assert bench.tracker is not None, "the bench file declares it"
        found = self_calibrated(
            bench,
            bench.tracker,
            poses=self.poses,
            validation=self.validation,
            volume=self.volume,
            options=self.options,
            accuracy=self.accuracy,
            compute=compute or at_once,
            progress=self.progress,
            keep=keep,
        )
        _, error = found.held_out
        if self.accuracy is not None and error > self.accuracy:
            click.echo(
                f"accuracy {self.accuracy * 1e3:g} mm was not reached: {error * 1e3:.3g} mm at the "
                f"held-out poses after {len(found.fit.time)} fitted ones",
                err=True,
            )
        return found

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

    @contextmanager
    def _kept(self) -> Iterator[Callable[[Run], None]]:
        """Gives what writes each pose as soon as it is measured; raises UsageError where older ones
        would be lost."""
        from winchkit.runs.writer import write_run

        files = pose_names(self.output)
        held = [path for path in files.values() if path.exists()]
        if held:
            raise UsageError(
                f"{held[0]} holds poses of an earlier calibration; name another profile with -o, "
                "or move the file"
            )
        counts: dict[str, int] = {}

        def keep(run: Run) -> None:
            write_run(run, files[run.name], replace=True)
            counts[run.name] = len(run.time)

        try:
            yield keep
        except BaseException:
            self._tell_kept(counts)
            if counts.get("fit", 0) >= _FEWEST:
                fit, validation = files.values()
                with_validation = ["--validate", str(validation)] if "validation" in counts else []
                suggest_next(
                    "calibrate", self.robot, str(fit), *with_validation, "-o", str(self.output)
                )
            raise
        self._tell_kept(counts)

    def _tell_kept(self, counts: Mapping[str, int]) -> None:
        files = pose_names(self.output)
        for name, count in counts.items():
            note(f"written: {files[name]} ({count} poses)")
