"""Rows above the numbers: the unit of a time below its name, titles of rows above the times."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from winchkit.runs.importing.assignment import Assignment
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns

COUNT, STEP = 200, 0.667
"""Rows, and their interval in ms."""


def used(path: Path, text: str) -> dict[str, Assignment]:
    path.write_text(text)
    return {item.channel: item for item in guess_columns(read_table(path)).used}


def rows(*columns: object) -> str:
    """Times in ms and the sine of an angle in the further columns."""
    lines = []
    for k in range(COUNT):
        angle = 100 * math.sin(k / 20)
        lines.append(",".join([f"{k * STEP:.6g}", *(f"{angle:.5g}" for _ in columns)]))
    return "\n".join(lines) + "\n"


def test_the_unit_of_the_time_may_stand_in_the_row_of_the_names(tmp_path: Path) -> None:
    """A drive's monitor: numbers of its inputs above, what they record below."""
    head = (
        "Axis1\nNumber of sampling data,200\nSampling time interval(ms),0.667\n"
        "Time,Analog 1,Analog 2,Digital 1\nms,Position feedback (deg),Droop pulses,INP\n"
    )
    found = used(tmp_path / "monitor.csv", head + rows(1, 2, 3))
    assert (found["time"].unit, found["time"].factor) == ("ms", 1e-3)
    assert found["motor_angle"].source.startswith("Position feedback")


@pytest.mark.parametrize("quoted", [True, False])
def test_titles_of_the_rows_of_a_header_may_stand_above_the_times(
    quoted: bool, tmp_path: Path
) -> None:
    """LabVIEW SignalExpress: every channel has its own times, below the same title."""
    names = ['"Motor angle"', '"Force"'] if quoted else ["Motor angle", "Force"]
    head = (
        "Timestamp,2026-03-16 17:04:51,Timestamp,2026-03-16 17:04:51\n"
        "Interval,0.000667,Interval,0.000667\n"
        f"Channel name,{names[0]},Channel name,{names[1]}\nUnit,deg,Unit,N\n"
    )
    lines = [
        f"{k * STEP / 1e3:.9g},{100 * math.sin(k / 20):.5g},{k * STEP / 1e3:.9g},{k % 7}"
        for k in range(COUNT)
    ]
    found = used(tmp_path / "daq.csv", head + "\n".join(lines) + "\n")
    assert (found["time"].unit, found["time"].confidence) == ("s", "named")
    assert found["motor_angle"].factor == pytest.approx(math.pi / 180)
    assert found["tension"].factor == 1.0
