"""Estimators' metrics on numbers worked by hand, and the benchmarks of estimation in small."""

from __future__ import annotations

import json
import sys
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import dahl_estimator as figures
import low_speed_rectangle as rectangle
from winchkit.errors import UsageError
from winchkit.estimation.metrics import mean_relative_error, overshoot


def test_the_exact_step_is_far_nearer_than_eulers() -> None:
    errors = figures.coarse_errors()
    # What is left is where between two samples the cable turned round.
    assert 0 < errors["exact step"] < 0.1 * figures.LIMIT
    assert errors["euler"] > 5 * errors["exact step"]


def test_it_prints_all_it_promises(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(figures, "UPDATES", 200)
    monkeypatch.setattr(figures, "find_spec", lambda name: None)
    monkeypatch.setattr(sys, "argv", ["dahl_estimator.py", "--json", "--samples", "4000"])
    code = figures.main()
    answer = json.loads(capsys.readouterr().out)
    assert code == (1 if answer["broken"] else 0)
    assert answer["compile_seconds"] is None
    timed = answer["seconds"]
    assert {"update, plain", "constant limit, numpy"} <= set(timed)
    ratio = answer["times_faster"]["constant limit, numpy / constant limit, loop"]
    assert ratio == timed["constant limit, loop"] / timed["constant limit, numpy"]


def test_dahl_is_nearest_and_better_than_the_paper() -> None:
    answer: Any = rectangle.measure(rate=40.0, scale=0.15, seconds=40.0, winches=2, seed=3)
    none, coulomb, dahl = (answer["methods"][name] for name in rectangle.METHODS)
    assert dahl["mean"] < 0.5 * coulomb["mean"] < 0.5 * none["mean"]
    assert dahl["similarity"] > 0.98 > answer["paper"]["similarity"]
    # Without a model the error is of the size of the friction.
    assert 0.2 < none["mean"] / answer["sliding_friction"] < 1.2
    # The pulleys differ by 15 % each; a group of three is known to their mean.
    assert answer["identified"]["friction"] == pytest.approx(rectangle.FRICTION, rel=0.3)


def test_the_cables_carry_the_platform() -> None:
    """The sum of all cable forces, added up by itself, is the weight."""
    positions, accelerations = rectangle.rectangle(10.0, 1.0)
    lengths, tension = rectangle.ropes(positions, np.zeros_like(accelerations))
    exits, anchors = rectangle.robot()
    for k in (0, len(positions) // 2):
        ropes = exits - positions[k] - anchors
        assert np.allclose(np.linalg.norm(ropes, axis=1), lengths[k])
        pulls = ropes / lengths[k][:, None] * tension[k][:, None]
        assert np.allclose(pulls.sum(axis=0), [0, 0, 1000.0], atol=1e-6)
        assert np.allclose(np.cross(anchors, pulls).sum(axis=0), 0, atol=1e-6)


def test_the_rectangle_is_the_papers() -> None:
    positions, _ = rectangle.rectangle(200.0, 1.0)
    assert np.ptp(positions, axis=0) == pytest.approx([0.400, 0.430, 0.0], abs=1e-6)
    assert np.all(positions[:, 2] == 0.2)
    speed = np.linalg.norm(np.diff(positions, axis=0), axis=1) * 200.0
    assert np.max(speed) == pytest.approx(0.05, rel=1e-3)


def test_overshoot_is_the_highest_departure() -> None:
    assert overshoot([90.0, 104.0, 70.0], 100.0) == pytest.approx(0.04)
    assert overshoot([90.0, 95.0], 100.0) == pytest.approx(-0.05)
    assert overshoot([np.nan, 110.0], 100.0) == pytest.approx(0.1)
    assert np.isnan(overshoot([np.nan], 100.0))


def test_relative_error_is_the_mean_of_absolutes() -> None:
    assert mean_relative_error([90.0, 104.0, 100.0], 100.0) == pytest.approx(0.14 / 3)
    assert mean_relative_error([90.0, 220.0], [100.0, 200.0]) == pytest.approx(0.1)
    assert mean_relative_error([90.0, np.nan], 100.0) == pytest.approx(0.1)
    assert np.isnan(mean_relative_error([np.nan], 100.0))


@given(st.lists(st.floats(0.1, 1e4), min_size=1), st.floats(0.1, 1e4), st.floats(0.01, 100))
def test_units_do_not_matter(force: list[float], target: float, unit: float) -> None:
    scaled = [unit * value for value in force]
    one, other = mean_relative_error(force, target), mean_relative_error(scaled, unit * target)
    assert other == pytest.approx(one, rel=1e-9, abs=1e-12)
    assert overshoot(scaled, unit * target) == pytest.approx(overshoot(force, target), abs=1e-9)


def test_a_target_of_nothing_is_refused() -> None:
    with pytest.raises(UsageError, match="above 0"):
        overshoot([1.0], 0.0)
    with pytest.raises(UsageError, match="above 0"):
        mean_relative_error([1.0, 1.0], [1.0, -1.0])
