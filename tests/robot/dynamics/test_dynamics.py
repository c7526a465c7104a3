"""Dynamics of the platform: free fall, spinning top, pendulum, inverse of forward."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_cases import near, random_poses, shipped
from winchkit.errors import UsageError
from winchkit.model.rotation import rotation_by
from winchkit.robot import ForceLimits, Geometry, Pose, gravity_wrench
from winchkit.robot.dynamics.dynamics import (
    PlatformMotion,
    accelerations,
    dynamic_wrench,
    inverse_dynamics,
    mass_matrix,
    motion_of,
)
from winchkit.robot.dynamics.integration import ElasticCables, cable_forces, integrate
from winchkit.schema.profiles.robot import PlatformSpec
from winchkit.units import GRAVITY

Array = np.ndarray
BODY = PlatformSpec(3.0, (0.05, -0.02, 0.04), (0.02, 0.05, 0.06))
seeds = st.integers(0, 10_000)


def moving(seed: int, count: int = 5) -> PlatformMotion:
    rng = np.random.default_rng(seed)
    return PlatformMotion(
        random_poses(seed, count), rng.normal(size=(count, 6)), rng.normal(size=(count, 6))
    )


def one_cable() -> Geometry:
    return Geometry(
        np.array([[0.0, 0.0, 2.0]]), np.zeros((1, 3)), np.zeros(1), np.array([[0.0, 0.0, 1.0]])
    )


@settings(max_examples=40, deadline=None)
@given(seeds)
def test_the_inverse_dynamics_undoes_the_forward_dynamics(seed: int) -> None:
    motion = moving(seed)
    needed = -dynamic_wrench(BODY, motion)
    found = accelerations(BODY, motion.pose.rotation, motion.velocity, needed)
    np.testing.assert_allclose(found, motion.acceleration, atol=1e-10)


def test_at_rest_the_wrench_is_the_weight() -> None:
    pose = random_poses(1, 4)
    rest = PlatformMotion(pose, np.zeros((4, 6)), np.zeros((4, 6)))
    np.testing.assert_allclose(dynamic_wrench(BODY, rest), gravity_wrench(BODY, pose.rotation))


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_the_wrench_is_that_of_the_bodys_mass_points(seed: int) -> None:
    # Eight equal mass points at the corners of a box: positions differentiated twice by time.
    motion, half = moving(seed, 1), np.array([0.1, 0.2, 0.15])
    corners = half * np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    square = half**2
    body = replace(BODY, inertia=tuple(3.0 * (square.sum() - square)))
    arms = (corners + np.array(BODY.center_of_mass)) @ motion.pose.rotation[0].T
    spin, gain = motion.velocity[0, 3:], motion.acceleration[0, 3:]
    of_points = motion.acceleration[0, :3] + np.cross(gain, arms)
    of_points += np.cross(spin, np.cross(spin, arms))
    forces = 3.0 / 8 * (np.array([0.0, 0.0, -GRAVITY]) - of_points)
    expected = np.concatenate([forces.sum(axis=0), np.cross(arms, forces).sum(axis=0)])
    np.testing.assert_allclose(dynamic_wrench(body, motion)[0], expected, atol=1e-12)


def test_kinetic_energy_by_the_mass_matrix_is_that_of_konigs_theorem() -> None:
    motion = moving(3, 1)
    rotation, velocity = motion.pose.rotation, motion.velocity[0]
    center = velocity[:3] + np.cross(velocity[3:], rotation[0] @ np.array(BODY.center_of_mass))
    spin = rotation[0].T @ velocity[3:]
    expected = 3.0 * center @ center / 2 + np.array(BODY.inertia) @ spin**2 / 2
    found = velocity @ mass_matrix(BODY, rotation)[0] @ velocity / 2
    assert found == pytest.approx(expected, rel=1e-12)


def test_rates_of_a_body_that_turns_and_coasts() -> None:
    time, spin = np.linspace(0.0, 1.0, 41), np.array([0.3, -0.5, 0.8])
    start = rotation_by(np.array([0.4, 0.1, -0.2]))
    pose = Pose(
        np.stack([np.sin(time), time**2, 0 * time], axis=1),
        rotation_by(time[:, None] * spin) @ start,
    )
    motion = motion_of(time, pose)
    np.testing.assert_allclose(motion.velocity[:, 0], np.cos(time), atol=1e-5)
    np.testing.assert_allclose(motion.acceleration[5:-5, 1], 2.0, atol=1e-6)
    np.testing.assert_allclose(motion.velocity[:, 3:], np.tile(spin, (41, 1)), atol=1e-9)
    np.testing.assert_allclose(motion.acceleration[:, 3:], 0.0, atol=1e-7)


def test_a_platform_on_slack_cables_falls_freely_and_turns_as_a_top() -> None:
    cables = ElasticCables(np.array([1e5]), np.zeros(1))
    pose, spin = Pose(np.zeros((1, 3)), np.eye(3)[None]), np.array([0.4, 3.0, 0.2])
    body = replace(BODY, center_of_mass=(0.0, 0.0, 0.0))
    time = np.linspace(0.0, 0.5, 6)
    found = integrate(
        one_cable(),
        body,
        cables,
        (pose, np.concatenate([np.zeros(3), spin])),
        unstrained=lambda _: np.array([9.0]),
        time=time,
    )
    assert np.all(found.force == 0.0)
    np.testing.assert_allclose(found.pose.position[:, 2], -GRAVITY * time**2 / 2, atol=1e-7)
    # Euler's top: momentum in base axes and energy are constant.
    own = np.einsum("kji,kj->ki", found.pose.rotation, found.velocity[:, 3:])
    momentum = np.einsum("kij,kj->ki", found.pose.rotation, own * np.array(body.inertia))
    np.testing.assert_allclose(momentum, np.tile(spin * body.inertia, (6, 1)), atol=1e-6)
    energy = (own**2) @ np.array(body.inertia) / 2
    np.testing.assert_allclose(energy, energy[0], rtol=1e-6)
    assert np.ptp(own, axis=0).max() > 0.05, "the top precesses"


def test_small_swing_of_a_platform_on_one_stiff_cable_is_a_simple_pendulum() -> None:
    cables = ElasticCables(np.array([1e5]), np.zeros(1), 5e-3)
    body = replace(BODY, center_of_mass=(0.0, 0.0, 0.0))
    angle, length = 0.02, 2.0
    place = np.array([[length * np.sin(angle), 0.0, 2.0 - length * np.cos(angle)]])
    free = length - 3.0 * GRAVITY * length / 1e5
    period = 2 * np.pi * np.sqrt(length / GRAVITY) * (1 + angle**2 / 16)
    found = integrate(
        one_cable(),
        body,
        cables,
        (Pose(place, np.eye(3)[None]), np.zeros(6)),
        unstrained=lambda _: np.array([free]),
        time=np.array([0.0, period / 4, period / 2]),
        tolerance=1e-6,
    )
    x = found.pose.position[:, 0] / place[0, 0]
    np.testing.assert_allclose(x, [1.0, 0.0, -1.0], atol=1e-3)


def test_a_robot_stays_where_its_elastic_cables_balance_the_weight() -> None:
    robot = shipped("cabtive")
    body = PlatformSpec(3.0, (0.0, 0.0, 0.02), (0.02, 0.02, 0.03))
    pose = robot.home
    structure = robot.structure(pose)
    rest = PlatformMotion(pose, np.zeros((1, 6)), np.zeros((1, 6)))
    force = np.full(8, 60.0)
    force -= np.linalg.pinv(structure[0]) @ (dynamic_wrench(body, rest)[0] + structure[0] @ force)
    cables = ElasticCables(np.full(8, 5e4), robot.dead_length, 2e-3)
    there = robot.lengths(pose)[0]
    # L of f = EA (L − L0)/(L0 + d), solved for L0.
    free = (5e4 * there - force * robot.dead_length) / (5e4 + force)
    shown = cable_forces(robot.geometry, cables, pose, np.zeros((1, 6)), free)
    np.testing.assert_allclose(shown[0], force, rtol=1e-9)
    found = integrate(
        robot.geometry,
        body,
        cables,
        (pose, np.zeros(6)),
        unstrained=lambda _: free,
        time=np.array([0.0, 0.1]),
    )
    np.testing.assert_allclose(found.pose.position[1], pose.position[0], atol=1e-8)


def test_inverse_dynamics_of_a_robot_balances_and_turns_the_winches() -> None:
    robot = shipped("cabtive")
    robot = replace(robot, platform=PlatformSpec(3.0, (0.0, 0.0, 0.0), (0.02, 0.02, 0.03)))
    time = np.linspace(0.0, 1.0, 21)
    pose = Pose(
        robot.home.position + 0.03 * np.stack([np.sin(3 * time), 0 * time, time * 0], axis=1),
        np.repeat(robot.home.rotation, 21, axis=0),
    )
    motion = motion_of(time, pose)
    found = inverse_dynamics(robot, time, motion, ForceLimits(5.0, 200.0))
    assert np.all(np.isfinite(found.force))
    left = np.einsum("kij,kj->ki", robot.structure(pose), found.force) + found.wrench
    np.testing.assert_allclose(left, 0.0, atol=1e-6)
    assert np.ptp(found.wrench[:, 0]) == pytest.approx(np.ptp(3.0 * motion.acceleration[:, 0]))
    assert not robot.lines[0].modifiers
    arm = [robot.lines[0].arm(angle) for angle in found.motor_angle[:, 0]]
    np.testing.assert_allclose(found.motor_torque[:, 0], found.force[:, 0] * arm, rtol=1e-6)


def test_no_torque_where_no_forces_hold_the_platform() -> None:
    robot = shipped("cabtive")
    pose = near(robot, 1, 5, 0.01, 0.0)
    motion = PlatformMotion(pose, np.zeros((5, 6)), np.zeros((5, 6)))
    motion.acceleration[2, 2] = -1e4
    robot = replace(robot, platform=BODY)
    found = inverse_dynamics(robot, np.arange(5.0), motion, ForceLimits(5.0, 200.0))
    assert np.all(np.isnan(found.motor_torque[2]))


def test_forward_dynamics_needs_an_inertia() -> None:
    with pytest.raises(UsageError, match="principal moments"):
        accelerations(PlatformSpec(3.0), np.eye(3)[None], np.zeros((1, 6)), np.zeros((1, 6)))
    with pytest.raises(UsageError, match="at least 4"):
        motion_of(np.arange(2.0), random_poses(1, 2))
