"""Poses that meet their lengths, searched over the whole frame; second solutions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robot_forward
from robot_cases import random_geometry, shipped
from winchkit.model.rotation import rotation_by
from winchkit.robot import PLAIN, Geometry, Pose, RobotCycle, flat_pose, forward, lengths

Array = np.ndarray
seeds = st.integers(0, 10**6)
MIRROR = np.diag([1.0, 1.0, -1.0])


def flat(count: int = 8) -> Geometry:
    """Exit points in the plane z = 0, anchors in the plane of the platform's x and y."""
    rng, turn = np.random.default_rng(3), 2 * np.pi * np.arange(count) / count
    exits = np.stack([3 * np.cos(turn), 2 * np.sin(turn), 0 * turn], axis=1)
    exits[:, :2] += rng.uniform(-0.3, 0.3, (count, 2))
    anchors = np.zeros((count, 3))
    anchors[:, :2] = rng.uniform(-0.4, 0.4, (count, 2))
    return Geometry(exits, anchors, np.zeros(count), np.tile([0.0, 0.0, 1.0], (count, 1)))


@pytest.mark.parametrize("name", robot_forward.ROBOTS)
def test_every_pose_of_the_frame_is_found_and_none_is_wrong(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(robot_forward, "fastest", lambda: PLAIN)
    for cut in ("TOLD", "CONTRADICTING", "COLD"):
        monkeypatch.setattr(robot_forward, cut, 20)
    found = robot_forward.figures(name, 300, 45)
    assert robot_forward.misses({name: found}) == []
    assert found["another"] == 0


@settings(max_examples=15, deadline=None)
@given(seeds, st.sampled_from([6, 7, 8, 12]))
def test_converged_means_that_the_lengths_are_met(seed: int, count: int) -> None:
    """Of poses with solutions and of lengths that no pose has, of any robot."""
    rng = np.random.default_rng(seed)
    geometry = random_geometry(seed % 1000, count)
    position = rng.uniform(-0.8, 0.8, (20, 3))
    rotation = rotation_by(rng.uniform(-0.6, 0.6, (20, 3)))
    wanted = lengths(geometry, position, rotation)
    wanted[10:] += rng.uniform(-0.3, 0.3, (10, count))
    start = Pose(np.zeros((1, 3)), np.eye(3)[None])
    found = forward(geometry, wanted, start)
    left = lengths(geometry, found.pose.position, found.pose.rotation) - wanted
    known = np.isfinite(wanted).all(axis=1)
    assert np.abs(left[found.converged]).max(initial=0.0) <= 0.02
    assert found.converged[:10][known[:10]].all()
    assert np.abs(left[:10][known[:10]]).max(initial=0.0) < 1e-7
    assert np.isnan(found.pose.position[~found.converged]).all()


@settings(max_examples=10, deadline=None)
@given(seeds)
def test_the_mirrored_pose_of_a_flat_robot_is_reported(seed: int) -> None:
    rng, geometry = np.random.default_rng(seed), flat()
    position = np.array([*rng.uniform(-0.8, 0.8, 2), rng.uniform(-1.5, -0.5)])[None]
    rotation = rotation_by(rng.uniform(-0.3, 0.3, (1, 3)))
    wanted = lengths(geometry, position, rotation)
    start = Pose(np.array([[0.0, 0.0, -1.0]]), np.eye(3)[None])
    found = forward(geometry, wanted, start, search=-1.0)
    np.testing.assert_allclose(found.pose.position, position, atol=1e-7)
    np.testing.assert_allclose(found.other.position, position @ MIRROR, atol=1e-7)
    np.testing.assert_allclose(found.other.rotation, MIRROR @ rotation @ MIRROR, atol=1e-7)
    assert np.isnan(forward(geometry, wanted, start).other.position).all()


def test_of_mirror_images_a_point_mass_hangs_in_the_lower_one() -> None:
    """Four cables from nearly one plane, with lengths that are some millimetres off."""
    rng = np.random.default_rng(5)
    exits = np.array([[4.4, -1.9, 2.6], [-4.4, -2.0, 2.65], [-4.4, 1.9, 2.65], [4.4, 1.9, 2.6]])
    still = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    geometry = Geometry(
        exits, np.zeros((4, 3)), np.zeros(4), np.tile([0.0, 0.0, 1.0], (4, 1)), still
    )
    position = rng.uniform([-3.5, -1.5, 0.0], [3.5, 1.5, 2.0], (300, 3))
    wanted = lengths(geometry, position, np.eye(3)[None]) + rng.standard_t(3, (300, 4)) * 3e-3
    start = Pose(position, np.tile(np.eye(3), (300, 1, 1)))
    found = forward(geometry, wanted, start, tolerance=np.inf, search="outlying")
    assert np.linalg.norm(found.pose.position - position, axis=1).max() < 0.2


def test_a_cable_that_disagrees_leaves_no_pose_and_its_residual() -> None:
    robot = shipped("cabtive")
    wanted = robot.lengths(robot.home)
    wanted[0, 2] += 0.1
    found = forward(robot.geometry, wanted, robot.home)
    assert not found.converged[0]
    assert np.isnan(found.pose.position).all()
    assert np.abs(found.residual).max() > 0.02
    nearest = forward(robot.geometry, wanted, robot.home, tolerance=np.inf)
    assert nearest.converged[0]


def test_poses_of_measured_lengths_are_searched_where_they_stand_out() -> None:
    robot, rng = shipped("ipanema3"), np.random.default_rng(8)
    true = robot_forward.drawn(robot, 200, rng)
    wanted = robot.lengths(true) + rng.normal(0, 1e-4, (200, 8))
    plain = forward(robot.geometry, wanted, robot.home, search=np.inf, tolerance=np.inf)
    found = forward(robot.geometry, wanted, robot.home, search="outlying", tolerance=np.inf)
    off = [np.linalg.norm(one.pose.position - true.position, axis=1) for one in (plain, found)]
    assert np.count_nonzero(off[0] > 0.05) > 20
    assert np.nanmax(off[1]) < 0.05


@pytest.mark.parametrize("wrong", [False, True])
def test_a_cycle_has_no_pose_for_lengths_that_disagree(wrong: bool) -> None:
    robot = shipped("cabtive")
    cycle = RobotCycle(robot)
    wanted = robot.lengths(robot.home)[0]
    wanted[1] += 0.1 if wrong else 0.002
    found = cycle.pose_at(wanted.tolist())
    assert (found is None) == wrong
    there = cycle.pose_at(robot.lengths(robot.home)[0].tolist())
    np.testing.assert_allclose(there, flat_pose(robot.home), atol=1e-9)


def test_a_pose_beyond_reach_is_unknown() -> None:
    geometry = replace(random_geometry(6), swivel_radius=np.zeros(8))
    found = forward(geometry, np.full((1, 8), 1e-3), Pose(np.zeros((1, 3)), np.eye(3)[None]))
    assert not found.converged[0]
