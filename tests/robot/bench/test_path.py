"""Paths of the platform: lengths and curvatures in closed form, and smoothness at corners."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.robot import Pose, angles_of, rotation_of
from winchkit.robot.bench.path import Waypoint, paths_through

HOME = Pose(np.zeros((1, 3)), np.eye(3)[None])
SCALE = 0.5
coordinate = st.floats(-0.5, 0.5)
point = st.tuples(coordinate, coordinate, coordinate)


def to(
    *position: float, blend: float = 0.0, via: Array | None = None, yaw: float = 0.0
) -> Waypoint:
    return Waypoint(np.array(position), rotation_of(0.0, 0.0, yaw), via, blend)


def test_a_line_is_as_long_as_the_distance_and_rotation_is_in_proportion() -> None:
    (path,) = paths_through(HOME, [to(0.3, 0.4, 0.0, yaw=0.2)], SCALE)
    assert path.length == pytest.approx(np.hypot(0.5, 0.2 * SCALE))
    assert path.curvature == pytest.approx(0.0, abs=1e-6)
    middle = path.pose(np.array([path.length / 2]))
    assert middle.position[0] == pytest.approx([0.15, 0.2, 0.0])
    assert angles_of(middle.rotation)[0] == pytest.approx([0.0, 0.0, 0.1])


def test_a_rotation_alone_is_a_path() -> None:
    (path,) = paths_through(HOME, [to(0, 0, 0, yaw=0.3)], SCALE)
    assert path.length == pytest.approx(0.3 * SCALE)


def test_a_half_circle_has_the_length_and_curvature_of_a_circle() -> None:
    arc = to(0.4, 0.0, 0.0, via=np.array([0.2, 0.2, 0.0]))
    (path,) = paths_through(HOME, [arc], SCALE)
    assert path.length == pytest.approx(pi * 0.2, rel=1e-4)
    assert path.curvature == pytest.approx(5.0, rel=0.02)
    places = path.pose(np.linspace(0, path.length, 50)).position
    assert np.linalg.norm(places - [0.2, 0, 0], axis=1) == pytest.approx(np.full(50, 0.2), rel=1e-5)
    assert np.all(places[:, 1] >= -1e-9), "it passes `via`, not the other half"


def test_an_arc_needs_three_points_that_are_not_on_a_line() -> None:
    with pytest.raises(UsageError, match="not on a line"):
        paths_through(HOME, [to(0.4, 0, 0, via=np.array([0.2, 0.0, 0.0]))], SCALE)


def test_without_blend_the_platform_stops_and_goes_nowhere_twice() -> None:
    rectangle = [to(0.4, 0, 0), to(0.4, 0.43, 0), to(0.4, 0.43, 0), to(0, 0.43, 0), to(0, 0, 0)]
    paths = paths_through(HOME, rectangle, SCALE)
    assert [path.length for path in paths] == pytest.approx([0.4, 0.43, 0.4, 0.43])


@settings(max_examples=30, deadline=None)
@given(corner=point, end=point, blend=st.floats(0.005, 0.2))
@example(corner=(0.08664115128770666, 0.0, 0.1875), end=(0.1484375, 0.0, -0.25), blend=0.03125)
def test_a_blended_corner_is_smooth_and_near_the_corner(
    corner: tuple[float, ...], end: tuple[float, ...], blend: float
) -> None:
    first, second = np.array(corner), np.array(end) - np.array(corner)
    sizes = np.linalg.norm(first), np.linalg.norm(second)
    if min(sizes) < 0.05 or first @ second < -0.9 * sizes[0] * sizes[1]:
        return
    (path,) = paths_through(HOME, [to(*corner, blend=blend), to(*end)], SCALE)
    distance = np.linspace(0.0, path.length, 400)
    tangent, _ = path.derivatives(distance)
    assert np.linalg.norm(tangent, axis=1) == pytest.approx(np.ones(400), abs=0.01)
    places = path.pose(distance).position
    assert places[-1] == pytest.approx(end)
    nearest = np.linalg.norm(places - first, axis=1).min()
    assert nearest <= blend, "the corner is cut by less than the blend"


def test_a_right_angle_is_cut_by_the_distance_of_the_middle_of_its_curve() -> None:
    (path,) = paths_through(HOME, [to(0.1, 0, 0, blend=0.02), to(0.1, 0.1, 0)], SCALE)
    places = path.pose(np.linspace(0.0, path.length, 2001)).position
    # Bernstein weights at 1/2 of the four control points beside the corner: (1, 5, 5, 1)/32.
    middle = 0.02 * (1 + 5 / 2) / 32 * np.sqrt(2)
    assert np.linalg.norm(places - [0.1, 0, 0], axis=1).min() == pytest.approx(middle, rel=1e-3)


def test_angular_derivatives_are_those_of_the_rotation() -> None:
    first = Waypoint(np.array([0.1, 0.0, 0.0]), rotation_of(0.4, 0.0, 0.9), None, 0.04)
    second = Waypoint(np.array([0.1, 0.1, 0.0]), rotation_of(-0.5, 0.6, 0.2))
    (path,) = paths_through(HOME, [first, second], SCALE)
    distance = np.linspace(0.01, path.length - 0.01, 40)
    step, small = 1e-4, 1e-6
    found = [path.derivatives(distance + by)[0][:, 3:] for by in (-small, 0.0, small)]
    turned = [Rotation.from_matrix(path.pose(distance + by).rotation) for by in (-step, step)]
    rate = (turned[1] * turned[0].inv()).as_rotvec() / (2 * step)
    assert found[1] == pytest.approx(rate, abs=1e-4)
    change = (found[2] - found[0]) / (2 * small)
    assert path.derivatives(distance)[1][:, 3:] == pytest.approx(change, abs=0.02)
