"""benchmarks/robot_tick.py and ipanema3_poses.py run and print what they promise to print."""

from __future__ import annotations

import json
import sys

import pytest

import ipanema3_poses
import robot_tick


def test_the_tick_benchmark_reports_figures_ratios_and_what_is_broken(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A short one: what it measures on a busy machine is no verdict here."""
    monkeypatch.setattr(robot_tick, "ROUNDS", 1)
    monkeypatch.setattr(robot_tick, "MANY", 2000)
    monkeypatch.setattr(robot_tick, "BATCH", 20)
    monkeypatch.setattr(robot_tick, "find_spec", lambda name: None)
    monkeypatch.setattr(sys, "argv", ["robot_tick.py", "--json"])
    code = robot_tick.main()
    answer = json.loads(capsys.readouterr().out)
    assert code == (1 if answer["broken"] else 0)
    assert {"tick, plain", "forward, plain", "inverse, a pose of many"} <= set(answer["seconds"])
    assert set(answer["broken"]) <= set(answer["limits"])
    assert answer["times_faster"]["inverse, a pose of many / inverse, numpy one by one"] > 3
    assert answer["compile_seconds"] is None


def test_the_17_poses_as_json(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["ipanema3_poses.py", "--json"])
    assert ipanema3_poses.main() == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["table_2"]["worse_after"] == [10, 11, 14, 15]
    assert answer["predicted_without_correction"]["correlation"] >= 0.97


def test_both_print_the_same_text(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["ipanema3_poses.py"])
    assert ipanema3_poses.main() == 0
    lines = capsys.readouterr().out.splitlines()
    assert sum(line.endswith("worse") for line in lines) == 4
    assert lines[17].split()[:6] == ["17", "1100", "1100", "2350", "73.043", "51.618"]
