"""Rotations against scipy's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from winchkit.model.rotation import (
    quaternion_of,
    rotation_by,
    rotation_from_quaternion,
    rotation_rates,
    rotation_vector,
)
from winchkit.robot import angles_of, rotation_of

angle = st.floats(-3.1, 3.1)
vectors = st.tuples(angle, angle, angle).map(np.array)


@settings(deadline=None)
@given(angle, st.floats(-1.5, 1.5), angle)
def test_angles_are_roll_pitch_yaw(roll: float, pitch: float, yaw: float) -> None:
    rotation = rotation_of(roll, pitch, yaw)
    expected = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix()
    np.testing.assert_allclose(rotation, expected, atol=1e-15)
    np.testing.assert_allclose(angles_of(rotation), [roll, pitch, yaw], atol=1e-12)


@settings(deadline=None)
@given(angle, angle, st.sampled_from([-1, 1]))
def test_angles_of_an_upright_platform_give_the_rotation_back(
    roll: float, yaw: float, sign: int
) -> None:
    rotation = rotation_of(roll, sign * np.pi / 2, yaw)
    found = angles_of(rotation)
    assert found[0] == 0.0
    np.testing.assert_allclose(rotation_of(*found), rotation, atol=1e-9)


@settings(deadline=None)
@given(vectors)
def test_rotation_vectors(vector: np.ndarray) -> None:
    expected = Rotation.from_rotvec(vector)
    rotation = rotation_by(vector)
    np.testing.assert_allclose(rotation, expected.as_matrix(), atol=1e-14)
    back = rotation_vector(rotation)
    np.testing.assert_allclose(rotation_by(back), rotation, atol=1e-12)
    assert np.linalg.norm(back) <= np.pi + 1e-12


@pytest.mark.parametrize("size", [0.0, 1e-300, 1e-12, 1e-8])
def test_small_rotations_stay_exact(size: float) -> None:
    vector = size * np.array([1.0, -2.0, 2.0])
    rotation = rotation_by(vector)
    np.testing.assert_allclose(rotation - np.eye(3), -(rotation - np.eye(3)).T, atol=9 * size**2)
    np.testing.assert_allclose(rotation_vector(rotation), vector, rtol=1e-7, atol=1e-16)


@settings(deadline=None)
@given(vectors)
def test_quaternions_are_scalar_first_with_a_positive_one(vector: np.ndarray) -> None:
    expected = Rotation.from_rotvec(vector)
    found = quaternion_of(expected.as_matrix())
    theirs = expected.as_quat(canonical=True, scalar_first=True)
    assert found[0] >= 0
    assert min(np.linalg.norm(found - theirs), np.linalg.norm(found + theirs)) < 1e-12
    np.testing.assert_allclose(
        rotation_from_quaternion(-3.0 * theirs), expected.as_matrix(), atol=1e-14
    )


def test_batches_are_their_members() -> None:
    vectors = np.random.default_rng(0).normal(size=(5, 4, 3))
    rotation = rotation_by(vectors)
    assert rotation.shape == (5, 4, 3, 3)
    for found, back in ((angles_of, lambda a: rotation_of(*np.moveaxis(a, -1, 0))),):
        np.testing.assert_allclose(back(found(rotation)), rotation, atol=1e-12)
    np.testing.assert_allclose(rotation_from_quaternion(quaternion_of(rotation)), rotation)
    np.testing.assert_allclose(rotation[3, 2], rotation_by(vectors[3, 2]))


@settings(deadline=None, max_examples=50)
@given(vectors, vectors, vectors, st.sampled_from([1.0, 0.05, 0.0]))
def test_rates_of_a_rotation_vector(
    vector: np.ndarray, first: np.ndarray, second: np.ndarray, size: float
) -> None:
    vector = size * vector / 2
    step = 1e-4

    def there(t: float) -> Rotation:
        return Rotation.from_rotvec(vector + t * first + t * t / 2 * second)

    def velocity(t: float) -> np.ndarray:
        turn = there(t + step) * there(t - step).inv()
        return np.asarray(turn.as_rotvec() / (2 * step))

    found, change = rotation_rates(vector, first, second)
    np.testing.assert_allclose(found, velocity(0.0), atol=1e-5)
    expected = (velocity(step) - velocity(-step)) / (2 * step)
    np.testing.assert_allclose(change, expected, atol=2e-4 * (1 + np.linalg.norm(first)) ** 3)
