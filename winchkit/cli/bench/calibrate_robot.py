"""``winchkit calibrate --bench``: the bench drives its robot to poses, measures and fits them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from winchkit.cli.core.messages import note
from winchkit.errors import UsageError

if TYPE_CHECKING:
    from winchkit.bench.robot.self_calibration import PoseVolume, SelfCalibration
    from winchkit.calibration.robot.calibrate import Options
    from winchkit.cli.core.terminal import ProgressCallback
    from winchkit.runs.run import Run

__all__ = ["calibrated_by_bench", "pose_names"]


def pose_names(output: Path) -> dict[str, Path]:
    """Files of the measured poses beside the written profile, by run."""
    return {name: output.with_name(f"{output.stem}-{name}.csv") for name in ("fit", "validation")}


def calibrated_by_bench(
    bench: str,
    robot: str,
    output: Path,
    *,
    poses: int,
    validation: int,
    volume: PoseVolume,
    options: Options,
    accuracy: float | None,
    progress: ProgressCallback,
) -> SelfCalibration:
    """Open the bench as its owner, and calibrate; the poses are written as they are measured."""
    from winchkit.bench.open import open_bench
    from winchkit.bench.remote.identity import client_name
    from winchkit.bench.robot.computation import ComputationProcess
    from winchkit.bench.robot.self_calibration import self_calibrated
    from winchkit.catalog import find
    from winchkit.runs.writer import write_run
    from winchkit.schema.read import read_bench

    spec = read_bench(bench)
    if spec.robot is None or spec.robot.tracker is None:
        raise UsageError(
            f"{bench}: declares no robot with a tracker; write [robot] with tracker = "
            '{ listen = "udp://127.0.0.1:5100" } (docs/howto/tracker.md)'
        )
    own = find("profiles", spec.robot.profile, beside=spec.path or None)
    if own.resolve() != find("profiles", robot).resolve():
        raise UsageError(f"ROBOT is '{robot}', the bench moves '{spec.robot.profile}'")
    files = pose_names(output)
    held = [path for path in files.values() if path.exists()]
    if held:
        raise UsageError(
            f"{held[0]} holds poses of an earlier calibration; name another profile with -o, or "
            "move the file"
        )

    def keep(run: Run) -> None:
        write_run(run, files[run.name])
        note(f"written: {files[run.name]} ({len(run.time)} poses)")

    with (
        ComputationProcess() as compute,
        open_bench(bench, name=client_name("calibrate"), realtime="try") as opened,
    ):
        tracker = opened.tracker
        assert tracker is not None, "the bench file declares it"
        return self_calibrated(
            opened,
            tracker,
            poses=poses,
            validation=validation,
            volume=volume,
            options=options,
            accuracy=accuracy,
            compute=compute,
            progress=progress,
            keep=keep,
        )
