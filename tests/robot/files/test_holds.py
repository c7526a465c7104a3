"""Holds of a robot's log: found in known motions, and none in a list of poses."""

from __future__ import annotations

import numpy as np
import pytest

from winchkit.arrays import Array
from winchkit.robot.files.holds import averaged, holds_of

LINES, RAMP = 4, 12


def motion(sizes: list[int], sigma: float, *, seed: int = 1, count: float = 0.0) -> Array:
    """Motor angles of holds of known sizes with smooth ramps between them."""
    rng = np.random.default_rng(seed)
    stops = rng.uniform(-3, 3, (len(sizes), LINES))
    share = (0.5 - 0.5 * np.cos(np.pi * (np.arange(RAMP) + 0.5) / RAMP))[:, None]
    parts = []
    for n, size in enumerate(sizes):
        parts.append(np.tile(stops[n], (size, 1)))
        if n + 1 < len(sizes):
            parts.append((1 - share) * stops[n] + share * stops[n + 1])
    out = np.concatenate(parts) + rng.normal(0, sigma, (sum(map(len, parts)), LINES))
    return np.round(out / count) * count if count else out


@pytest.mark.parametrize(
    ("sigma", "count"), [(1e-4, 0.0), (0.0, 0.0), (0.0, 1e-3), (4e-4, 1e-3), (1e-2, 0.0)]
)
def test_holds_are_those_of_the_motion(sigma: float, count: float) -> None:
    sizes = [20, 35, 11, 60, 24, 30, 18, 9, 40, 25]
    found = holds_of(motion(sizes, sigma, count=count))
    assert found is not None
    assert len(found) == len(sizes)
    starts = np.cumsum([0, *(size + RAMP for size in sizes[:-1])])
    for hold, start, size in zip(found, starts, sizes, strict=True):
        # A ramp begins and ends within the noise.
        assert abs(hold.start - start) <= 2
        assert abs(hold.stop - (start + size)) <= 2


def test_a_servo_that_swings_by_a_count_between_rows_of_a_log_is_at_rest() -> None:
    """Counts that are interpolated to the instants of another source are no whole numbers."""
    sizes, count = [50] * 8, 1e-4
    angle = motion(sizes, 0.0, count=count)
    toggles = np.random.default_rng(4).random(angle.shape) < [0.0, 0.05, 0.3, 0.5]
    angle = angle + count * toggles
    for share in (0.1, 0.5, 0.9):
        log = (1 - share) * angle[:-1] + share * angle[1:]
        found = holds_of(log)
        assert found is not None
        assert len(found) == len(sizes)
        assert all(abs(hold.stop - hold.start - 50) <= 3 for hold in found)


def test_a_list_of_poses_has_no_holds() -> None:
    rng = np.random.default_rng(2)
    poses = rng.uniform(-3, 3, (60, LINES))
    assert holds_of(poses) is None
    # Poses that were driven to twice, at the end or in a row.
    assert holds_of(np.concatenate([poses, poses[:15] + rng.normal(0, 1e-4, (15, LINES))])) is None
    assert holds_of(np.repeat(poses, 2, axis=0)) is None


def test_a_slow_path_without_a_stop_has_no_holds() -> None:
    time = np.linspace(0, 1, 80)[:, None]
    path = np.sin(2 * np.pi * time * np.array([1.0, 1.3, 0.7, 0.9]))
    assert holds_of(path + np.random.default_rng(3).normal(0, 1e-4, path.shape)) is None


def test_one_winch_that_moves_ends_a_hold() -> None:
    angle = motion([40, 40, 40], 1e-4)
    angle[10:20, 2] += 0.05
    found = holds_of(angle)
    assert found is not None
    assert not any(hold.start < 10 < hold.stop - 1 for hold in found)


def test_means_of_holds_ignore_what_is_missing_and_wrap_angles() -> None:
    values = np.array([[1.0, np.nan], [3.0, np.nan], [5.0, 2.0], [5.0, 4.0]])
    holds = [slice(0, 2), slice(2, 4)]
    np.testing.assert_array_equal(averaged(values, holds), [[2.0, np.nan], [5.0, 3.0]])
    angles = np.array([[np.pi - 0.1], [-np.pi + 0.3]])
    mean = averaged(angles, [slice(0, 2)], angles=True)
    assert float(np.cos(mean[0, 0])) == pytest.approx(np.cos(-np.pi + 0.1))
