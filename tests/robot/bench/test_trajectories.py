"""benchmarks/robot_trajectories.py runs, and its trajectories stay on their paths."""

from __future__ import annotations

import json
import sys

import pytest

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
