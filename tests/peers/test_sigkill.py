"""The owner of a bench is killed during a jog, and the drive in another process stops by itself."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(os.name != "posix", reason="SIGKILL is POSIX's"),
]

PROGRAM = Path(__file__).parents[2] / "benchmarks" / "sigkill_stop.py"


def test_a_killed_owner_leaves_no_winch_moving() -> None:
    """Three times; ``benchmarks/sigkill_stop.py --times 100`` does it a hundred times."""
    done = subprocess.run(
        [sys.executable, str(PROGRAM), "--times", "3"],
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    if "ip route add" in done.stderr:
        pytest.skip(f"no route for multicast here: {done.stderr}")
    assert done.returncode == 0, done.stdout + done.stderr
    figures = json.loads(done.stdout)
    assert figures["in_time"] == figures["times"] == 3
    # The watch of 2.5 heartbeats of 100 ms, and a ramp that takes some time as well.
    assert figures["worst_silence"] > 0.2
    assert figures["worst_after_kill"] > 0.2
