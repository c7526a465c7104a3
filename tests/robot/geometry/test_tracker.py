"""Readings of a tracker against the textbook's formula, derivatives, and its registration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from winchkit.arrays import Array
from winchkit.model.rotation import angles_of, rotation_by
from winchkit.robot import Pose
from winchkit.robot.geometry.tracker import (
    Tracker,
    pose_behind,
    reading_of,
    registered,
    registration,
    tracked_position,
    tracked_rotation,
)

HOME = np.array([0.36, 0.55, 0.56])
TRACKER = Tracker(
    HOME,
    np.array([0.1, -0.3, 0.2]),
    np.array([0.6, -1.5, 1.2]),
    np.array([0.03, 0.02, 0.08]),
    1e-3,
    np.array([0.1, 0.2, -0.3]),
)


def poses(count: int = 40, seed: int = 0) -> Pose:
    rng = np.random.default_rng(seed)
    turned = Rotation.from_rotvec(0.1 * rng.normal(size=(count, 3))).as_matrix()
    return Pose(HOME + 0.1 * rng.normal(size=(count, 3)), turned)


def test_a_reading_is_the_similarity_of_the_observed_point() -> None:
    pose, shown = poses(), reading_of(TRACKER, poses())
    turned = Rotation.from_rotvec(TRACKER.turn).as_matrix()
    mounting = Rotation.from_rotvec(TRACKER.mounting).as_matrix()
    origin, base = TRACKER.frame_in_base
    np.testing.assert_allclose(base, turned, atol=1e-12)
    for n in range(len(pose.position)):
        point = pose.position[n] + pose.rotation[n] @ TRACKER.offset
        np.testing.assert_allclose(shown.position[n], origin + 1.001 * turned @ point, atol=1e-12)
        np.testing.assert_allclose(
            shown.rotation[n], turned @ pose.rotation[n] @ mounting, atol=1e-12
        )
    behind = pose_behind(TRACKER, shown)
    np.testing.assert_allclose(behind.position, pose.position, atol=1e-12)
    np.testing.assert_allclose(behind.rotation, pose.rotation, atol=1e-12)


def slope(function: object, count: int) -> Array:
    steps = 1e-6 * np.eye(count)
    return np.stack(
        [(function(step) - function(-step)) / 2e-6 for step in steps],  # type: ignore[operator]
        axis=-1,
    )


@pytest.mark.parametrize("turns", [True, False])
def test_derivatives_are_those_of_the_residuals(turns: bool) -> None:
    tracker, pose = replace(TRACKER, turns_rotation=turns), poses(8)
    seen = reading_of(tracker, pose)
    angles = angles_of(seen.rotation)
    angles[::2, 2] = np.nan

    def moved(step: Array) -> Pose:
        return Pose(pose.position + step[:3], rotation_by(step[3:]) @ pose.rotation)

    def framed(step: Array) -> Tracker:
        return replace(tracker, shift=tracker.shift + step[:3], turn=tracker.turn + step[3:])

    place = tracked_position(tracker, pose, seen.position)
    for by, found in (
        (
            place.by_pose,
            slope(lambda s: tracked_position(tracker, moved(s), seen.position).residual, 6),
        ),
        (
            place.by_robot["tracker_frame"],
            slope(lambda s: tracked_position(framed(s), pose, seen.position).residual, 6),
        ),
        (
            place.by_robot["reflector"],
            slope(
                lambda s: (
                    tracked_position(
                        replace(tracker, offset=tracker.offset + s), pose, seen.position
                    ).residual
                ),
                3,
            ),
        ),
        (
            place.by_robot["tracker_scale"],
            slope(
                lambda s: (
                    tracked_position(
                        replace(tracker, scale=tracker.scale + float(s[0])), pose, seen.position
                    ).residual
                ),
                1,
            ),
        ),
    ):
        np.testing.assert_allclose(by, found, atol=1e-8)
    rotation = tracked_rotation(tracker, pose, angles)
    for by, found in (
        (
            rotation.by_pose,
            slope(lambda s: tracked_rotation(tracker, moved(s), angles).residual, 6),
        ),
        (
            rotation.by_robot["tracker_frame"],
            slope(lambda s: tracked_rotation(framed(s), pose, angles).residual, 6),
        ),
        (
            rotation.by_robot["mounting"],
            slope(
                lambda s: (
                    tracked_rotation(
                        replace(tracker, mounting=TRACKER.mounting + s), pose, angles
                    ).residual
                ),
                3,
            ),
        ),
    ):
        known = np.isfinite(angles)
        np.testing.assert_allclose(by[known], found[known], atol=1e-7)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([0.001, 0.3, 3.0]))
def test_exact_readings_are_registered_exactly(seed: int, size: float) -> None:
    rng, pose = np.random.default_rng(seed), poses(30, seed)
    true = Tracker(
        HOME,
        rng.normal(size=3),
        Rotation.random(random_state=seed).as_rotvec() * min(size, 1.0),
        0.05 * rng.normal(size=3),
        1e-3 * float(rng.normal()),
    )
    shown = reading_of(true, pose)
    found = registered(
        Tracker.at(HOME),
        pose,
        shown.position,
        angles_of(shown.rotation),
        {"frame", "reflector", "scale"},
    )
    again = reading_of(found, pose)
    np.testing.assert_allclose(again.position, shown.position, atol=1e-6)


def test_the_registration_is_that_of_scipy() -> None:
    rng, point = np.random.default_rng(3), poses().position
    turned = Rotation.from_rotvec([0.4, -2.0, 1.0])
    seen = turned.apply(point) + [1.0, 2.0, 3.0] + 1e-3 * rng.normal(size=point.shape)
    found, shift, scale = registration(seen, point)
    own, _ = Rotation.align_vectors(seen - seen.mean(axis=0), point - point.mean(axis=0))
    np.testing.assert_allclose(found, own.as_matrix(), atol=1e-9)
    np.testing.assert_allclose(shift, seen.mean(axis=0) - found @ point.mean(axis=0), atol=1e-12)
    assert scale == pytest.approx(1.0, abs=5e-3)


def test_mirrored_points_give_a_rotation() -> None:
    point = poses().position
    found, _, _ = registration(point * [1.0, 1.0, -1.0], point)
    assert np.linalg.det(found) == pytest.approx(1.0)
