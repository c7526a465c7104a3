"""Poses of a robot's tracker in the logs of its bench."""

from __future__ import annotations

import json
import socket
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from winchkit.bench.bench import Bench
from winchkit.bench.control.snapshot import BenchSnapshot
from winchkit.runs import read_run
from winchkit.schema.robot_bench import TrackerWiring


@pytest.fixture
def tracked(opened: Bench, monkeypatch: pytest.MonkeyPatch) -> Bench:
    """With a tracker that shows the bench's time as x, its clock being 5 s behind."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        address = f"udp://127.0.0.1:{probe.getsockname()[1]}"
    assert opened.spec.robot is not None
    robot = replace(opened.spec.robot, tracker=TrackerWiring(address))
    monkeypatch.setattr(opened, "spec", replace(opened.spec, robot=robot))
    return opened


@pytest.mark.parametrize("suffix", [".csv", ".mcap"])
def test_a_log_has_the_poses_of_the_tracker(tracked: Bench, tmp_path: Path, suffix: str) -> None:
    bench, path = tracked, tmp_path / f"run{suffix}"
    tracker = bench.tracker
    assert tracker is not None
    assert bench.tracker is tracker, "one receiver for all"
    begin = bench.clock.now()

    def show(snapshot: BenchSnapshot) -> None:
        pose = {
            "schema": 1,
            "time": snapshot.time - 5.0,
            "position": [bench.clock.now() - begin, 2.0, -1.0],
            "quaternion": [0.6, 0.0, 0.8, 0.0],
        }
        tracker.receive(json.dumps(pose).encode())

    remove = bench.on_cycle(show)
    with bench.log(path):
        bench.clock.sleep(1.0)
    remove()
    tracker.close()
    bench._tracker = None
    run = read_run(path)
    x = run.channels["tracker_x"].values
    known = np.isfinite(x)
    assert known.mean() > 0.8
    assert np.diff(x[known]) == pytest.approx(np.diff(run.time[known]), abs=1e-6)
    assert run.channels["tracker_x"].unit == "m"
    assert run.channels["tracker_y"].values[known] == pytest.approx(2.0)
    assert run.channels["tracker_qy"].values[known] == pytest.approx(0.8)
    assert not any(name.startswith("platform") for name in run.channels), "frames are kept apart"
    assert not run.notes


def test_a_bench_without_tracker_has_no_channels_of_one(opened: Bench, tmp_path: Path) -> None:
    assert opened.tracker is None
    with opened.log(tmp_path / "run.csv"):
        opened.clock.sleep(0.2)
    assert not any("tracker" in name for name in read_run(tmp_path / "run.csv").channels)
