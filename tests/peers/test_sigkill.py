"""The owner of a bench is killed during a jog, and the drive in another process stops by itself."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import pytest

from command_line import own_process
from sim_process import free_port

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(os.name != "posix", reason="SIGKILL is POSIX's"),
]

PROGRAM = Path(__file__).parents[2] / "benchmarks" / "process_faults.py"


def test_a_killed_owner_leaves_no_winch_moving() -> None:
    """Three times; ``benchmarks/process_faults.py --times 100`` does it a hundred times."""
    free_port("239.0.0.1")
    done = own_process(sys.executable, PROGRAM, "--faults", "SIGKILL", "--times", "3", "--json")
    found = json.loads(done.stdout)["faults"]["SIGKILL"]
    assert found["stopped"] == found["cases"] == 3
    # The watch of 2.5 heartbeats of 100 ms, less one since the last, and the ramp of 0.1 s.
    assert found["worst_s"] > 0.15
