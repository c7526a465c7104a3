"""Cable lengths against tangents found by search, their derivatives against differences."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from robot_cases import random_geometry, random_poses
from winchkit.model.rotation import rotation_by
from winchkit.robot import (
    Geometry,
    Sensitivities,
    lengths,
    sensitivities,
    structure_matrix,
    swivel_angle,
    swivel_sensitivities,
    wrap_angle,
)
from winchkit.robot.geometry.hessian import length_hessian

Array = np.ndarray
seeds = st.integers(0, 10_000)
few = settings(max_examples=25, deadline=None)
STEP = 1e-6


def tangent_by_search(exit_point: Array, axis: Array, radius: float, anchor: Array) -> float:
    """Go round the pulley until the cable leaves it straight towards the anchor."""
    seen = anchor - exit_point
    outward = seen - (seen @ axis) * axis
    outward /= np.linalg.norm(outward)
    centre = exit_point + radius * outward

    def leaving(angle: float) -> tuple[Array, Array]:
        spoke = -np.cos(angle) * outward + np.sin(angle) * axis
        return centre + radius * spoke, np.sin(angle) * outward + np.cos(angle) * axis

    def aside(angle: float) -> float:
        """Of the anchor from the tangent, along the spoke."""
        touch, _ = leaving(angle)
        return float((anchor - touch) @ (touch - centre))

    grid = np.linspace(0.0, 2 * np.pi, 721)
    for low, high in itertools.pairwise(grid):
        if aside(low) * aside(high) <= 0:
            angle = brentq(aside, low, high, xtol=1e-14)
            touch, direction = leaving(angle)
            if (anchor - touch) @ direction > 0:
                return radius * angle + float(np.linalg.norm(anchor - touch))
    raise AssertionError("no tangent")


@few
@given(seeds)
def test_lengths_are_those_of_the_tangent(seed: int) -> None:
    geometry, poses = random_geometry(seed, 4), random_poses(seed + 1, 2)
    geometry = replace(geometry, swivel_radius=geometry.swivel_radius + 0.01)
    found = lengths(geometry, poses.position, poses.rotation)
    for p in range(2):
        for i in range(4):
            anchor = poses.position[p] + poses.rotation[p] @ geometry.anchor_point[i]
            expected = tangent_by_search(
                geometry.exit_point[i], geometry.swivel_axis[i], geometry.swivel_radius[i], anchor
            )
            assert found[p, i] == pytest.approx(expected, abs=1e-10)


def one_line(x: float, y: float, radius: float) -> tuple[float, float]:
    """Length and wrap of a cable that arrives upwards in the origin, anchor at (x, 0, y)."""
    geometry = Geometry(
        np.zeros((1, 3)), np.zeros((1, 3)), np.array([radius]), np.array([[0.0, 0.0, 1.0]])
    )
    at = (np.array([[x, 0.0, y]]), np.eye(3)[None])
    return float(lengths(geometry, *at)[0, 0]), float(wrap_angle(geometry, *at)[0, 0])


def test_simple_places_of_the_anchor() -> None:
    r = 0.1
    assert one_line(0.0, 2.0, r) == pytest.approx((2.0, 0.0), abs=1e-12)
    assert one_line(2 * r, -1.0, r) == pytest.approx((np.pi * r + 1.0, np.pi))
    assert one_line(1.0 + r, r, r) == pytest.approx((np.pi / 2 * r + 1.0, np.pi / 2))
    # Behind the pulley: three quarters of a turn and more.
    assert one_line(0.02, -0.3, r)[1] > np.pi
    assert one_line(r, -0.3, r)[0] == pytest.approx(one_line(r - 1e-9, -0.3, r)[0], abs=1e-8)


def test_without_a_radius_the_exit_point_is_fixed() -> None:
    geometry, poses = random_geometry(3), random_poses(4, 10)
    geometry = replace(geometry, swivel_radius=np.zeros(8))
    anchors = poses.position[:, None] + np.einsum(
        "pij,nj->pni", poses.rotation, geometry.anchor_point
    )
    expected = np.linalg.norm(anchors - geometry.exit_point, axis=2)
    np.testing.assert_allclose(lengths(geometry, poses.position, poses.rotation), expected)


def test_an_anchor_inside_its_pulley_has_no_length() -> None:
    length, wrap = one_line(0.1, 0.05, 0.1)
    assert np.isnan(length)
    assert np.isnan(wrap)


@few
@given(seeds)
def test_moving_everything_alike_changes_no_length(seed: int) -> None:
    geometry, poses = random_geometry(seed), random_poses(seed, 5)
    rng = np.random.default_rng(seed)
    turn, shift = rotation_by(rng.normal(size=3)), rng.normal(size=3)
    moved = replace(
        geometry,
        exit_point=geometry.exit_point @ turn.T + shift,
        swivel_axis=geometry.swivel_axis @ turn.T,
    )
    np.testing.assert_allclose(
        lengths(moved, poses.position @ turn.T + shift, turn @ poses.rotation),
        lengths(geometry, poses.position, poses.rotation),
        atol=1e-12,
    )


def test_many_poses_are_each_pose() -> None:
    geometry, poses = random_geometry(1), random_poses(2, 2500)
    together = lengths(geometry, poses.position, poses.rotation)
    for p in (0, 1023, 1024, 2047, 2048, 2499):
        alone = lengths(geometry, poses.position[p : p + 1], poses.rotation[p : p + 1])
        np.testing.assert_allclose(together[p], alone[0], rtol=1e-14)


def differences(quantity: object, geometry: Geometry, poses: object) -> Sensitivities:
    """Central differences of ``quantity`` by everything, ``STEP`` either way."""
    position, rotation = poses.position, poses.rotation

    def slope(of: object) -> Array:
        change = of(STEP) - of(-STEP)
        return (change + np.pi) % (2 * np.pi) - np.pi if quantity is swivel_angle else change

    def by(kind: str, k: int) -> Array:
        unit = np.eye(3)[k]
        moved = {
            "position": lambda h: quantity(geometry, position + h * unit, rotation),
            "rotation": lambda h: quantity(geometry, position, rotation_by(h * unit) @ rotation),
            "exit_point": lambda h: quantity(
                replace(geometry, exit_point=geometry.exit_point + h * unit), position, rotation
            ),
            "anchor_point": lambda h: quantity(
                replace(geometry, anchor_point=geometry.anchor_point + h * unit), position, rotation
            ),
        }[kind]
        return slope(moved) / (2 * STEP)

    kinds = ("position", "rotation", "exit_point", "anchor_point")
    radius = slope(
        lambda h: quantity(
            replace(geometry, swivel_radius=geometry.swivel_radius + h), position, rotation
        )
    )
    return Sensitivities(
        *(np.stack([by(kind, k) for k in range(3)], axis=-1) for kind in kinds), radius / (2 * STEP)
    )


@few
@given(seeds)
def test_derivatives_of_lengths_are_differences(seed: int) -> None:
    geometry, poses = random_geometry(seed), random_poses(seed, 3)
    geometry = replace(geometry, swivel_radius=geometry.swivel_radius + 2 * STEP)
    found = sensitivities(geometry, poses.position, poses.rotation)
    expected = differences(lengths, geometry, poses)
    for name in ("position", "rotation", "exit_point", "anchor_point", "swivel_radius"):
        np.testing.assert_allclose(
            getattr(found, name), getattr(expected, name), atol=2e-8, err_msg=name
        )
    np.testing.assert_allclose(np.linalg.norm(found.position, axis=-1), 1.0)


@few
@given(seeds)
def test_derivatives_of_swivel_angles_are_differences(seed: int) -> None:
    geometry, poses = random_geometry(seed), random_poses(seed, 3, size=0.5)
    found = swivel_sensitivities(geometry, poses.position, poses.rotation)
    expected = differences(swivel_angle, geometry, poses)
    for name in ("position", "rotation", "exit_point", "anchor_point", "swivel_radius"):
        ours, theirs = getattr(found, name), getattr(expected, name)
        # An anchor close to the axis turns the pulley fast, and differences lose digits.
        np.testing.assert_allclose(ours, theirs, rtol=1e-5, atol=1e-7, err_msg=name)


@few
@given(seeds, st.floats(-3.0, 3.0))
def test_turning_the_anchor_about_the_axis_turns_the_pulley(seed: int, angle: float) -> None:
    geometry = random_geometry(seed, 1)
    poses = random_poses(seed, 1)
    axis, exit_point = geometry.swivel_axis[0], geometry.exit_point[0]
    turn = rotation_by(angle * axis)
    moved = exit_point + (poses.position - exit_point) @ turn.T
    before = swivel_angle(geometry, poses.position, poses.rotation)
    after = swivel_angle(geometry, moved, turn @ poses.rotation)
    assert np.cos(after - before - angle)[0, 0] == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(
        lengths(geometry, moved, turn @ poses.rotation),
        lengths(geometry, poses.position, poses.rotation),
        atol=1e-12,
    )


def test_swivel_angle_of_an_upright_pulley_counts_from_x() -> None:
    geometry = Geometry(
        np.zeros((1, 3)), np.zeros((1, 3)), np.array([0.05]), np.array([[0.0, 0.0, 1.0]])
    )
    places = np.array([[1.0, 0.0, -1.0], [0.0, 1.0, -1.0], [-1.0, -1e-9, 1.0], [0.0, 0.0, 1.0]])
    found = swivel_angle(geometry, places, np.tile(np.eye(3), (4, 1, 1)))[:, 0]
    np.testing.assert_allclose(found[:3], [0.0, np.pi / 2, -np.pi], atol=1e-8)
    assert np.isnan(found[3])


@few
@given(seeds)
def test_structure_matrix_is_virtual_work(seed: int) -> None:
    """The work of the cables, force times shortening, is that of their wrench."""
    geometry, poses = random_geometry(seed), random_poses(seed, 4)
    rng = np.random.default_rng(seed)
    velocity, spin, force = rng.normal(size=3), rng.normal(size=3), rng.uniform(1, 9, 8)

    def after(time: float) -> Array:
        return lengths(
            geometry, poses.position + time * velocity, rotation_by(time * spin) @ poses.rotation
        )

    shortening = (after(-STEP) - after(STEP)) / (2 * STEP)
    wrench = structure_matrix(geometry, poses.position, poses.rotation) @ force
    power = wrench @ np.concatenate([velocity, spin])
    np.testing.assert_allclose(power, shortening @ force, atol=1e-6)


@few
@given(seeds)
def test_second_derivatives_are_differences_of_the_first(seed: int) -> None:
    geometry, poses = random_geometry(seed), random_poses(seed, 3)

    def length(pose: Array) -> Array:
        turned = rotation_by(pose[3:]) @ poses.rotation
        return lengths(geometry, poses.position + pose[:3], turned)

    found = length_hessian(geometry, poses.position, poses.rotation)
    unit = 1e-3 * np.eye(6)
    for a in range(6):
        for b in range(6):
            corners = (
                length(unit[a] + unit[b])
                - length(unit[a] - unit[b])
                - length(unit[b] - unit[a])
                + length(-unit[a] - unit[b])
            )
            np.testing.assert_allclose(found[..., a, b], corners / 4e-6, atol=2e-4)
