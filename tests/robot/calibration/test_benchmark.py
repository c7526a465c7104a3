"""robot_tick, ipanema3_poses and robot_metrology of benchmarks/ print what they promise."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

import ipanema3_poses
import robot_tick
from robot_metrology import drawn, judged, random_frames, summary


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


def test_cases_are_drawn_over_instruments_and_effects_and_repeat_with_the_seed() -> None:
    cases = list(drawn(12, 5))
    assert {(c.instrument, c.case.name) for c in cases} == {
        (i, r)
        for i in ("frame", "reflector", "scale")
        for r in ("none", "home length", "exit point", "drum radius")
    }
    assert cases == list(drawn(12, 5))


@pytest.mark.slow
@pytest.mark.campaign
def test_a_small_run_is_right(tmp_path: Path) -> None:
    rows = []
    for n, hidden in enumerate(drawn(3, 31)):
        folder = tmp_path / str(n)
        folder.mkdir()
        rows.append(judged(hidden, folder))
    assert json.loads(json.dumps(rows)) == rows
    told = summary(rows)
    assert told["instrument and effect in the first set"] == "3 of 3"
    assert told["a wrong line named alone"] == "0 of 3"
    assert told["raw files within 0.04 mm and 0.03 deg"] == "3 of 3"


@pytest.mark.slow
def test_random_frames_never_crash() -> None:
    told = random_frames(8, 3)
    assert told["crashed"] == 0
    assert told["largest_error_mm"] < 1.0
