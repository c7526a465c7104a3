"""Plans and fits in a process of their own: results, errors, interruptions, and its end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from winchkit.catalog import find
from winchkit.errors import MotionError, NotPermitted, WinchkitError
from winchkit.robot.bench.computation import ComputationProcess, at_once
from winchkit.robot.bench.path import Waypoint
from winchkit.robot.bench.planner import Planner, moved
from winchkit.schema.read import read_bench, read_simbench


def nothing() -> None:
    """Nothing to look at meanwhile."""


@pytest.fixture(scope="module")
def process() -> Iterator[ComputationProcess]:
    with ComputationProcess() as started:
        yield started


def test_a_plan_is_that_of_the_same_interpreter(process: ComputationProcess) -> None:
    planner = Planner.of(read_simbench(find("sim", "cabtive-robot")).bench)
    home = planner.robot.home
    goal = moved(home, {"x": 0.02, "yaw": 0.03}, relative=True)
    arguments = ([Waypoint(goal.position[0], goal.rotation[0])], home)
    there = process(nothing, planner.plan, *arguments)[0]
    here = at_once(nothing, planner.plan, *arguments)[0]
    assert np.array_equal(there.motor_angle, here.motor_angle)
    assert np.array_equal(there.time, here.time)


def test_it_raises_what_the_function_raises(process: ComputationProcess) -> None:
    planner = Planner.of(read_simbench(find("sim", "cabtive-robot")).bench)
    home = planner.robot.home
    far = moved(home, {"x": 9.0}, relative=True)
    with pytest.raises(NotPermitted):
        process(nothing, planner.plan, [Waypoint(far.position[0], far.rotation[0])], home)
    assert process(nothing, abs, -3) == 3


def test_a_file_that_is_missing_is_the_error_of_the_file(process: ComputationProcess) -> None:
    with pytest.raises(WinchkitError, match=r"nowhere\.toml"):
        process(nothing, read_bench, "nowhere.toml")


def test_what_stops_the_bench_ends_the_wait() -> None:
    def stopped() -> None:
        raise MotionError("Ann stopped the bench")

    with ComputationProcess() as process:
        begin = time.monotonic()
        with pytest.raises(MotionError, match="Ann stopped"):
            process(stopped, time.sleep, 60)
    assert time.monotonic() - begin < 30


def test_its_end_is_an_error(process: ComputationProcess) -> None:
    with ComputationProcess() as other, pytest.raises(WinchkitError, match=r"has ended \(exit -9"):
        other(nothing, _kill_own_process)
    assert process(nothing, abs, -3) == 3


def test_priorities_of_the_bench_are_not_its_own(process: ComputationProcess) -> None:
    assert process(nothing, os.sched_getscheduler, 0) == os.SCHED_OTHER


def test_it_ends_with_a_parent_that_is_killed(tmp_path: Path) -> None:
    script = tmp_path / "parent.py"
    script.write_text(
        "import os, signal\n"
        "from winchkit.robot.bench.computation import ComputationProcess\n"
        "if __name__ == '__main__':\n"
        "    process = ComputationProcess()\n"
        "    print(process(lambda: None, os.getpid), flush=True)\n"
        "    signal.pause()\n"
    )
    with subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        child = int(parent.stdout.readline())
        parent.send_signal(signal.SIGKILL)
    deadline = time.monotonic() + 60
    while Path(f"/proc/{child}").exists() and _running(child):
        assert time.monotonic() < deadline, "the process outlives its parent"
        time.sleep(0.05)


def _running(process: int) -> bool:
    """Whether it is running, and not merely an exit status to be read."""
    status = Path(f"/proc/{process}/stat").read_text()
    return status.rpartition(")")[2].split()[0] != "Z"


def _kill_own_process() -> None:
    os.kill(os.getpid(), signal.SIGKILL)
