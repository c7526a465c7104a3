"""Mechanics of the simulated platform against closed forms, energy, and another implementation."""

from __future__ import annotations

from math import atan2, hypot, pi, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from winchkit.arrays import Array
from winchkit.robot import Pose, rotation_of
from winchkit.robot.geometry.kinematics import Geometry, lengths, structure_matrix, wrap_angle
from winchkit.robot.sim.platform import CablePlatform, Pulleys, RigidBody
from winchkit.robot.sim.rotation import quaternion, rotation, turned
from winchkit.units import GRAVITY

angle = st.floats(-1.5, 1.5)
small = st.floats(-0.3, 0.3)
UP = np.array([0.0, 0.0, 1.0])


def plain(exits: Array, axis: Array = UP, radius: float = 0.0) -> Pulleys:
    return Pulleys(exits, np.tile(axis, (len(exits), 1)), np.full(len(exits), radius))


def point_mass(exits: Array, at: Array, mass: float, damping_time: float = 0.0) -> CablePlatform:
    """A small ball whose cables all meet in its centre."""
    body = RigidBody(mass, np.zeros(3), 0.01 * np.eye(3), np.zeros((len(exits), 3)))
    return CablePlatform(body, plain(exits), at, np.eye(3), damping_time)


@given(roll=angle, pitch=angle, yaw=angle)
def test_rotations_are_those_of_scipy(roll: float, pitch: float, yaw: float) -> None:
    there = Rotation.from_euler("ZYX", [yaw, pitch, roll])
    assert rotation(roll, pitch, yaw) == pytest.approx(there.as_matrix(), abs=1e-12)
    w, x, y, z = quaternion(rotation(roll, pitch, yaw))
    assert Rotation.from_quat([x, y, z, w]).as_matrix() == pytest.approx(there.as_matrix())
    vector = Rotation.from_rotvec([roll, pitch, yaw]).as_matrix()
    assert turned((roll, pitch, yaw)) == pytest.approx(vector, abs=1e-12)


@settings(max_examples=50)
@given(x=small, y=small, z=small, yaw=small, pitch=small)
def test_lengths_directions_and_wraps_are_those_of_the_model(
    x: float, y: float, z: float, yaw: float, pitch: float
) -> None:
    exits = np.array([[1.0, 1, 1], [-1, 1, 1.2], [-1, -1, 0.9], [1, -1, 1]])
    anchors = np.array([[0.2, 0.1, 0], [-0.1, 0.1, 0.1], [-0.1, -0.2, 0], [0.1, -0.1, -0.1]])
    pulleys = plain(exits, UP, 0.03)
    body = RigidBody(1.0, np.zeros(3), np.eye(3), anchors)
    pose = Pose(np.array([[x, y, z]]), rotation_of(0.1, pitch, yaw)[None])
    platform = CablePlatform(body, pulleys, pose.position[0], pose.rotation[0], 0.0)
    model = Geometry(exits, anchors, pulleys.radius, pulleys.axis)
    assert platform.length == pytest.approx(lengths(model, pose.position, pose.rotation)[0])
    assert platform.wrap == pytest.approx(wrap_angle(model, pose.position, pose.rotation)[0])
    force = np.array([5.0, 7, 9, 11])
    pulled = structure_matrix(model, pose.position, pose.rotation)[0] @ force
    weight = np.array([0, 0, -GRAVITY, 0, 0, 0])
    assert platform.unbalanced(force) - weight == pytest.approx(pulled, abs=1e-9)


def test_three_cables_carry_a_point_mass_as_in_closed_form() -> None:
    corners = np.array([[0.0, 1], [-sqrt(3) / 2, -0.5], [sqrt(3) / 2, -0.5]])
    exits = np.column_stack([corners, np.full(3, 2.0)])
    ball = point_mass(exits, np.array([0.0, 0, 0.5]), 3.0)
    share = 3.0 * GRAVITY / 3 / (1.5 / hypot(1, 1.5))
    assert ball.equilibrium(10.0) == pytest.approx(np.full(3, share))


def test_it_comes_to_rest_where_elastic_cables_carry_it() -> None:
    ball = point_mass(np.array([[0.0, 0, 2]]), np.array([0.0, 0, 1]), 2.0, damping_time=0.05)
    free, stiffness = np.array([1.0]), np.array([500.0])
    for n in range(2000):
        ball.advance((n + 1) * 2e-3, free, free, stiffness)
    assert ball.position[2] == pytest.approx(1.0 - 2.0 * GRAVITY / 500.0, abs=1e-6)
    assert ball.tension[0] == pytest.approx(2.0 * GRAVITY, abs=1e-3)


def test_a_pendulum_swings_with_its_frequency() -> None:
    start = 0.02
    at = np.array([1.5 * np.sin(start), 0.0, 2 - 1.5 * np.cos(start)])
    ball = point_mass(np.array([[0.0, 0, 2]]), at, 1.0, damping_time=0.002)
    stiffness = np.array([1e6])
    free = np.array([1.5 - GRAVITY / 1e6])
    ball.tension = np.array([GRAVITY])
    angles = []
    for n in range(5000):
        ball.advance((n + 1) * 1e-3, free, free, stiffness)
        x, _, z = ball.position
        angles.append(atan2(x, 2 - z))
    signs = np.sign(angles)
    crossings = np.flatnonzero(np.diff(signs)) * 1e-3
    period = 2 * np.mean(np.diff(crossings))
    assert period == pytest.approx(2 * pi * sqrt(1.5 / GRAVITY), rel=2e-3)
    assert max(angles[-2500:]) == pytest.approx(start, rel=1e-3)


def test_work_of_the_drums_is_stored_or_dissipated() -> None:
    """Power in through the cables' upper ends = change of energy + heat of the dampers."""
    exits = np.array([[s, t, h] for s in (-1.0, 1) for t in (-1.0, 1) for h in (0.0, 2)])
    anchors = exits * [0.1, 0.12, 0.05] + [0.0, 0, -0.05]
    body = RigidBody(5.0, np.array([0.01, 0, 0.02]), np.diag([0.1, 0.15, 0.2]), anchors)
    platform = CablePlatform(body, plain(exits, UP, 0.02), UP * 1.0, np.eye(3), 0.003)
    platform.tension = platform.equilibrium(80.0)
    assert np.all(platform.tension > 0)
    stiffness = np.full(8, 2e4)
    damper = 0.003 * stiffness
    free = platform.length - platform.tension / stiffness
    stretch = platform.length - free

    def energy() -> float:
        spin = platform.velocity[3:]
        turn = platform.rotation @ body.inertia @ platform.rotation.T
        moving = 5.0 * platform.velocity[:3] @ platform.velocity[:3] + spin @ turn @ spin
        return float(moving / 2 + 5.0 * GRAVITY * platform.center[2] + stiffness @ stretch**2 / 2)

    before, work, heat, peak = energy(), 0.0, 0.0, 0.0
    dt = 2.5e-4
    rate = np.array([0.05, -0.03, 0.04, -0.05, -0.04, 0.03, -0.05, 0.05])
    for n in range(1200):
        wave = rate * np.sin(2 * pi * n * dt / 0.3)
        pull, gap = platform.tension.copy(), platform.speed - wave
        platform.advance((n + 1) * dt, free, free + wave * dt, stiffness)
        free = free + wave * dt
        stretch = platform.length - free
        work -= dt * float((pull + platform.tension) / 2 @ wave)
        heat += dt * float(damper @ ((gap + platform.speed - wave) / 2) ** 2)
        peak = max(peak, abs(work))
    assert np.all(platform.tension > 0)
    assert heat > 0.001 * peak
    assert energy() - before == pytest.approx(work - heat, abs=0.01 * peak)


def test_a_free_body_keeps_its_momentum() -> None:
    body = RigidBody(2.0, np.zeros(3), np.diag([0.1, 0.2, 0.25]), np.zeros((1, 3)))
    platform = CablePlatform(body, plain(np.array([[0.0, 0, 9]])), np.zeros(3), np.eye(3), 0.0)
    platform.velocity = np.array([0.3, 0, 0, 2.0, 1.0, 0.5])
    momentum = body.inertia @ platform.velocity[3:]
    slack = np.array([50.0])
    for n in range(1000):
        platform.advance((n + 1) * 1e-3, slack, slack, np.array([1e4]))
    turn = platform.rotation @ body.inertia @ platform.rotation.T
    assert turn @ platform.velocity[3:] == pytest.approx(momentum, rel=0.01)
    assert platform.velocity[2] == pytest.approx(-GRAVITY)
    assert platform.position[2] == pytest.approx(-GRAVITY / 2, rel=1e-3)


@pytest.mark.slow
def test_the_compiled_step_moves_as_the_plain_one() -> None:
    pytest.importorskip("numba")
    exits = np.array([[s, t, h] for s in (-1.0, 1) for t in (-1.0, 1) for h in (0.0, 2)])
    anchors = exits * [0.1, 0.12, 0.05] + [0.0, 0, -0.05]
    body = RigidBody(5.0, np.array([0.01, 0, 0.02]), np.diag([0.1, 0.15, 0.2]), anchors)
    pulleys = plain(exits, UP, 0.02)
    both = [
        CablePlatform(body, pulleys, UP * 1.0, np.eye(3), 0.003, compiled=compiled)
        for compiled in (False, True)
    ]
    stiffness = np.full(8, 2e4)
    for platform in both:
        platform.tension = platform.equilibrium(80.0)
        free = platform.length - platform.tension / stiffness
        for n in range(200):
            new = free + 1e-3 * np.sin(0.1 * n + np.arange(8))
            platform.advance((n + 1) * 2.5e-3, free, new, stiffness)
            free = new
    assert both[1].position == pytest.approx(both[0].position, rel=1e-9)
    assert both[1].velocity == pytest.approx(both[0].velocity, abs=1e-9)
    assert both[1].tension == pytest.approx(both[0].tension, rel=1e-7)
    assert both[0].velocity @ both[0].velocity > 1e-6
