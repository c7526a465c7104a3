"""A robot that calibrates itself: hidden geometry and a tracker in a frame of its own."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import robot_rectangle
import robot_self_calibrated
from winchkit.bench.bench import Bench
from winchkit.bench.tracker import TrackedPose, TrackerReceiver
from winchkit.errors import MotionError, UsageError
from winchkit.robot.bench.self_calibration import PoseVolume, _stages, self_calibrated
from winchkit.runs.run import Run


@pytest.mark.slow
def test_cables_stay_taut_where_the_points_are_5_mm_wrong() -> None:
    """A cable of this robot falls below 2 N where motions go on by the profile's geometry."""
    found = robot_self_calibrated.measure(281141, 20, 4, "40 ms")
    assert found["written"]
    assert not found["refused"]
    assert found["held_out_after_mm"] < 0.04 < found["held_out_before_mm"]


@given(st.integers(10, 500))
def test_the_volume_grows_with_the_poses_that_are_fitted(poses: int) -> None:
    stages = _stages(poses)
    counts, shares = zip(*stages, strict=True)
    assert sum(counts) == poses
    assert min(counts) >= 10
    assert list(shares) == sorted(shares)
    assert shares[-1] == 1.0
    assert len(stages) == min(3, poses // 10)


@pytest.mark.slow
@pytest.mark.campaign
def test_the_rectangle_needs_an_estimate_of_the_friction() -> None:
    found = robot_rectangle.measure(3, cycle=0.04, scale=0.06, moves=2)
    assert found["dahl_N"] < 0.2 * found["none_N"]
    assert found["dahl_N"] < found["coulomb_N"]
    assert np.mean(found["friction"]) == pytest.approx(0.012, rel=0.15)


def test_too_few_poses_are_refused_before_anything_moves() -> None:
    with pytest.raises(UsageError, match="at least 10 and 1"):
        self_calibrated(None, TrackerReceiver(lambda: 0.0), poses=9)  # type: ignore[arg-type]


def test_a_quick_stop_between_two_poses_ends_the_calibration(bench: Bench) -> None:
    """The platform stands then, so that the stop ends no motion; the next one must not begin."""
    rested: list[list[float]] = []

    def angles() -> list[float]:
        return [winch.motor_angle for winch in bench.snapshot.winch.values()]

    class Stopping(TrackerReceiver):
        def require(self, since: float, address: str) -> list[TrackedPose]:
            bench.stop_now()
            rested.append(angles())
            return [TrackedPose(since, bench.clock.now(), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))]

    volume = PoseVolume(0.002, 0.0, 0.1, 0.1)
    kept: list[Run] = []
    with pytest.raises(MotionError, match="stopped the bench between two motions"):
        self_calibrated(bench, Stopping(bench.clock.now), poses=10, volume=volume, keep=kept.append)
    bench.clock.sleep(0.5)
    assert bench.snapshot.at_rest
    assert rested == [pytest.approx(angles(), abs=1e-3)]
    # The pose that was measured before the stop is not lost.
    assert [run.name for run in kept] == ["fit"]
    assert [kept[0][f"{name}.motor_angle"][0] for name in "12345678"] == pytest.approx(
        rested[0], abs=1e-3
    )
