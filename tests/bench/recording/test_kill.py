"""A small share of benchmarks/recorder_kill.py: SIGKILL costs at most 0.3 s."""

from __future__ import annotations

import random
import sys
from pathlib import Path

import pytest

from recorder_kill import kill_once

MOMENTS = random.Random(7)
LOSS = {"mcap": 0.3, "csv": 0.3}
"""s"""


@pytest.mark.realtime
@pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL is POSIX")
@pytest.mark.parametrize(
    ("moment", "rotate", "suffix"),
    [
        (MOMENTS.uniform(0, 1.5), rotate, suffix)
        for suffix in ("mcap", "csv")
        for rotate in (None, "1s", None, "10kB", None)
    ],
)
def test_a_killed_recording_loses_little_and_is_recovered(
    tmp_path: Path, moment: float, rotate: str | None, suffix: str
) -> None:
    """Whole to the last flush, as the package ``mcap`` and Python's own csv reader find it."""
    killed = kill_once(tmp_path, moment, rotate, suffix)
    assert killed.lost <= LOSS[suffix]
    assert killed.gaps == 0
    assert killed.whole
    assert killed.recovered
