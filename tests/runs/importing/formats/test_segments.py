"""LabVIEW files of several segments, each with a start and a step of its own."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from winchkit.errors import RunError
from winchkit.runs.importing.pieces import jumps_of
from winchkit.runs.importing.session import import_runs
from winchkit.runs.importing.streams import Stream, Streams

MARK = "***End_of_Header***"


def angle(time: float) -> float:
    return 3 * math.sin(1.1 * time) + 0.2 * time


def segmented(
    path: Path, parts: Sequence[tuple[str, float, int]], *, stamped: bool, names: str = ""
) -> Path:
    """A file; ``parts``: time of day, step and samples of each; ``names``: of the last segment."""
    lines = ["LabVIEW Measurement", "Separator\tTab", "Decimal_Separator\t,", MARK, ""]
    for number, (clock, step, count) in enumerate(parts):
        lines += [
            "Channels\t2\t\t",
            f"Samples\t{count}\t{count}\t",
            "Date\t2026/03/04\t2026/03/04\t",
        ]
        lines += [
            f"Time\t{clock}\t{clock}\t",
            "Y_Unit_Label\tRad\tNm\t",
            "X_Dimension\tTime\tTime\t",
        ]
        lines += ["X0\t0,5\t0,5\t", f"Delta_X\t{step}\t{step}\t".replace(".", ","), f"{MARK}\t\t\t"]
        last = names and number == len(parts) - 1
        lines.append(f"X_Value\t{names if last else 'Encoder'}\tTorque\tComment")
        for k in range(count):
            time = 0.5 + k * step
            cells = [f"{time:.3f}" if stamped else "", f"{angle(time):.7f}", f"{0.1 * k:.4f}"]
            lines.append("\t".join(cells).replace(".", ","))
        lines.append("")
    path.write_text("\r\n".join(lines) + "\r\n")
    return path


@pytest.mark.parametrize("stamped", [False, True])
def test_segments_follow_each_other_by_their_starts(stamped: bool, tmp_path: Path) -> None:
    parts = [("10:11:12,5", 0.01, 300), ("10:11:32,75", 0.01, 200)]
    (found,) = import_runs(segmented(tmp_path / "log.lvm", parts, stamped=stamped))
    own = [0.01 * np.arange(300), 0.01 * np.arange(200)]
    assert found.time == pytest.approx(np.concatenate([own[0], own[1] + 20.25]))
    expected = [angle(time) for part in own for time in part + 0.5]
    assert found["motor_angle"] == pytest.approx(expected, abs=1e-6)


def test_a_segment_of_another_step_is_a_run_of_its_own(tmp_path: Path) -> None:
    parts = [("10:11:12,5", 0.01, 300), ("10:11:32,75", 0.02, 200), ("10:11:52", 0.01, 150)]
    found = import_runs(segmented(tmp_path / "log.lvm", parts, stamped=False))
    assert [(len(run), round(float(np.diff(run.time).max()), 6)) for run in found] == [
        (300, 0.01),
        (200, 0.02),
        (150, 0.01),
    ]


def test_segments_of_other_channels_are_refused_with_their_line(tmp_path: Path) -> None:
    parts = [("10:11:12,5", 0.01, 30), ("10:11:32,75", 0.01, 20)]
    path = segmented(tmp_path / "log.lvm", parts, stamped=False, names="Winkel")
    with pytest.raises(RunError, match="other channels or units than the first") as caught:
        import_runs(path)
    assert (
        caught.value.faults[0].line == path.read_text().splitlines().index("Channels\t2\t\t", 8) + 1
    )


@pytest.mark.parametrize("share", [0.1, 0.3, 0.5, 0.7, 0.9])
def test_lost_samples_and_jitter_are_no_change_of_the_interval(share: float) -> None:
    random = np.random.default_rng(1)
    for _ in range(20):
        jitter = np.abs(random.normal(0.01, 0.01 * share, 2000))
        for steps in (np.where(random.random(2000) < share, 0.02, 0.01), jitter):
            time = np.cumsum(steps)
            channels = {"motor_angle": np.sin(time)}
            stream = Stream(time, channels, np.arange(2000))
            streams = Streams(
                "log.csv",
                (stream,),
                origin=0.0,
                is_absolute=False,
                has_time=True,
                line_of=lambda _row: None,
            )
            assert not jumps_of(streams)
