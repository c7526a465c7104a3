"""Distances of cables against least squares and dense points, and how planned motions keep them."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from robot_poses.truth import HOME
from small_robots import planar
from winchkit.arrays import Array
from winchkit.errors import NotPermitted
from winchkit.robot import Pose, read_robot, robot_of, rotation_of
from winchkit.robot.bench.path import Waypoint
from winchkit.robot.bench.planner import Planner
from winchkit.robot.geometry.kinematics import straight_cables
from winchkit.robot.workspace.distances import distances
from winchkit.schema.bench import LimitSpec
from winchkit.schema.robot_bench import BodySpec, RobotWiring

CABTIVE = robot_of(read_robot("cabtive"))
LIMITS = LimitSpec(speed=1.0, acceleration=5.0)
BOX = BodySpec("table", (0.3, 0.6, 0.25), size=(0.3, 0.2, 0.1), rotation=(0.1, 0.2, 0.3))
COLUMN = BodySpec("column", (0.0, 0.1, 0.6), radius=0.05, height=0.7, rotation=(0.0, 0.3, 0.0))
TOOL = BodySpec("tool", (0.0, 0.0, 0.05), on="platform", radius=0.03, height=0.2)


def inside_out(body: BodySpec, pose: Pose, points: Array) -> Array:
    """Distances of points from a body: the nearest of many points of its surface and its edges."""
    own = (points - np.array(body.position)) @ rotation_of(*body.rotation)
    if body.on == "platform":
        own = (points - pose.position[0]) @ pose.rotation[0] - np.array(body.position)
        own = own @ rotation_of(*body.rotation)
    if body.size is not None:
        nearest = np.clip(own, -np.array(body.size) / 2, np.array(body.size) / 2)
    else:
        assert body.radius is not None
        assert body.height is not None
        radial = np.linalg.norm(own[:, :2], axis=1, keepdims=True)
        flat = own[:, :2] * np.minimum(1.0, body.radius / np.maximum(radial, 1e-12))
        tall = np.clip(own[:, 2:], -body.height / 2, body.height / 2)
        nearest = np.hstack([flat, tall])
    return np.asarray(np.linalg.norm(own - nearest, axis=1))


@settings(max_examples=8, deadline=None)
@given(
    x=st.floats(0.1, 0.6), y=st.floats(0.3, 0.8), z=st.floats(0.3, 0.8), yaw=st.floats(-0.4, 0.4)
)
def test_distances_are_those_of_dense_points(x: float, y: float, z: float, yaw: float) -> None:
    pose = Pose(np.array([[x, y, z]]), rotation_of(0.1, -0.2, yaw)[None])
    found = distances(CABTIVE, (BOX, COLUMN, TOOL), pose, 0.02)
    start, end = (points[0] for points in straight_cables(CABTIVE.geometry, pose))
    along = (end - start) / np.linalg.norm(end - start, axis=1, keepdims=True)
    share = np.linspace(0, 1, 400)[:, None]
    begin, stop = start + 0.04 * along, end - 0.04 * along
    cables = [a + share * (b - a) for a, b in zip(begin, stop, strict=True)]
    radius = [(winch.cable.diameter or 0.0) / 2 for winch in CABTIVE.winches]
    named = dict(zip(found.between, found.distance[0].tolist(), strict=True))
    assert len(named) == 28 + 3 * 8
    for i in range(8):
        for body in (BOX, COLUMN, TOOL):
            dense = float(inside_out(body, pose, cables[i]).min()) - radius[i]
            apart = named[f"cable {i + 1} and {body.name}"]
            assert apart == pytest.approx(dense, abs=2e-3) or (apart < dense <= 0)
        for k in range(i + 1, 8):
            ways = np.column_stack([stop[i] - begin[i], begin[k] - stop[k]])
            gap = lsq_linear(ways, begin[k] - begin[i], (0, 1), method="bvls", tol=1e-14)
            expected = sqrt(2 * gap.cost) - radius[i] - radius[k]
            assert named[f"cables {i + 1} and {k + 1}"] == pytest.approx(expected, abs=1e-9)


def planner(body: tuple[BodySpec, ...], clearance: float | None) -> Planner:
    wiring = RobotWiring("cabtive", speed=0.1, tension=(1.0, 500.0), clearance=clearance, body=body)
    return Planner(CABTIVE, wiring, dict.fromkeys(CABTIVE.names, LIMITS))


def test_a_motion_into_an_obstacle_is_refused_with_its_place() -> None:
    cable = straight_cables(CABTIVE.geometry, CABTIVE.home)
    beside = (cable[0][0, 0] + cable[1][0, 0]) / 2 + np.array([0.0, 0.06, 0.0])
    post = BodySpec("post", tuple(beside.tolist()), radius=0.01, height=0.3)
    goal = Waypoint(np.add(HOME, [0.0, 0.15, 0.0]), np.eye(3))
    home = CABTIVE.home
    assert planner((), None).plan([goal], home)
    with pytest.raises(NotPermitted) as refused:
        planner((post,), 0.02).plan([goal], home)
    words = str(refused.value)
    assert "mm of the path of 150 mm" in words
    assert "cable 1 and post are 2" in words or "cable 1 and post are 1" in words
    assert "clearance of [robot] is 20 mm" in words
    away = Waypoint(np.subtract(HOME, [0.0, 0.05, 0.0]), np.eye(3))
    assert planner((post,), 0.02).plan([away], home)


def test_a_planar_platform_is_moved_in_its_plane_alone() -> None:
    robot = planar()
    wiring = RobotWiring("small", speed=0.2, tension=(1.0, 300.0))
    own = Planner(robot, wiring, dict.fromkeys(robot.names, LIMITS))
    goal = Waypoint(np.array([0.3, 0.0, 1.2]), rotation_of(0.0, 0.1, 0.0))
    (motion,) = own.plan([goal], robot.home)
    np.testing.assert_allclose(motion.pose.position[:, 1], 0.0, atol=1e-12)
    assert np.isfinite(motion.force).all()
    with pytest.raises(NotPermitted, match="guides hold y at 0, and the goal"):
        own.plan([replace(goal, position=np.array([0.3, 0.1, 1.2]))], robot.home)
