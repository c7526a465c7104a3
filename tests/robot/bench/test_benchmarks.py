"""robot_trajectories.py and robot_faults.py of benchmarks/ in small."""

from __future__ import annotations

import json
import sys
from dataclasses import replace

import pytest

import robot_faults
import robot_trajectories


@pytest.mark.slow
def test_random_trajectories_stay_on_their_paths_within_the_limits_of_force(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(
        sys, "argv", ["robot_trajectories.py", "--trajectories", "3", "--seed", "7", "--json"]
    )
    code = robot_trajectories.main()
    found = json.loads(capsys.readouterr().out)
    assert code == 0
    assert found["trajectories"] == 3
    assert found["slack"] == found["above_limit"] == 0
    assert 5.0 < found["least_force_N"] < found["largest_force_N"] < 200.0
    assert found["forces_beyond_limits"] == 0
    assert found["least_margin_N"] > 0
    assert found["largest_path_error_mm"] < found["stated_path_error_mm"]


def test_the_same_seed_draws_the_same_cases_with_every_fault() -> None:
    cases = robot_faults.drawn(22, 3)
    assert cases == robot_faults.drawn(22, 3)
    assert cases != robot_faults.drawn(22, 4)
    assert {case.kind for case in cases} == {*robot_faults.FAULTS, robot_faults.BROKEN}


@pytest.mark.slow
def test_a_broken_cable_stops_all_winches_within_the_bounds() -> None:
    case = replace(robot_faults.drawn(11, 1)[10], share=0.3)
    assert case.kind == robot_faults.BROKEN
    outcome = robot_faults.played(case)
    assert outcome.good, outcome
    assert outcome.rest > 0.2, "slack has to hold for 0.2 s"
    assert outcome.displaced > 5e-3, "the platform goes where the other cables pull it"
