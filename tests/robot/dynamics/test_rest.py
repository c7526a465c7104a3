"""Rest and oscillations of hanging platforms against pendulums, energy and the simulator."""

from __future__ import annotations

from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest
from scipy.optimize import minimize

from small_robots import small_robot
from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.robot import Pose, read_robot, robot_of, rotation_of
from winchkit.robot.bench.path import Waypoint
from winchkit.robot.bench.planner import Planner
from winchkit.robot.dynamics.rest import pendulum_modes, rest_poses
from winchkit.robot.sim.platform import CablePlatform, Pulleys, RigidBody
from winchkit.schema.bench import LimitSpec
from winchkit.schema.robot_bench import RobotWiring
from winchkit.units import GRAVITY

HANGING = robot_of(read_robot("hanging-4"))


@pytest.mark.parametrize("count", [3, 4])
def test_a_platform_rests_where_its_energy_is_least(count: int) -> None:
    robot = robot_of(replace(HANGING.profile, line=HANGING.profile.line[:count]))
    wanted = Pose(np.array([[0.3, -0.2, 0.9]]), np.eye(3)[None])
    found = rest_poses(robot, wanted)
    assert found.stable.all()
    assert found.pose.position == pytest.approx(wanted.position)
    given = robot.lengths(found.pose)[0]

    def there(q: Array) -> Pose:
        return Pose(q[None, :3], rotation_of(*q[3:])[None])

    least = minimize(
        lambda q: q[2],
        np.array([0.25, -0.1, 1.0, 0.0, 0.0, 0.0]),
        method="SLSQP",
        constraints={"type": "ineq", "fun": lambda q: given - robot.lengths(there(q))[0]},
        options={"ftol": 1e-13, "maxiter": 500},
    )
    assert least.x[2] == pytest.approx(0.9, abs=1e-6)
    assert there(least.x).rotation[0] == pytest.approx(found.pose.rotation[0], abs=1e-3)
    weight = robot.platform.mass * GRAVITY
    wrench = robot.structure(found.pose)[0] @ found.force[0] + robot.weight(found.pose)[0]
    assert np.abs(wrench).max() < 1e-8 * weight


def test_pendulums_have_the_frequency_of_their_length() -> None:
    one = small_robot([(0.0, 0.0, 3.0)], [(0.0, 0.0, 0.0)], ("x", "z"), home=(0.0, 0.0, 1.2))
    two = small_robot(
        [(-0.4, 0.0, 3.0), (0.4, 0.0, 3.0)],
        [(-0.4, 0.0, 0.0), (0.4, 0.0, 0.0)],
        ("x", "z", "pitch"),
        home=(0.0, 0.0, 1.2),
        inertia=(0.1, 0.3, 0.3),
    )
    for robot in (one, two):
        # Two parallel cables carry a platform that swings without rotation.
        force = np.full((1, len(robot.names)), 4.0 * GRAVITY / len(robot.names))
        frequency, shape = pendulum_modes(robot, robot.home, force)
        assert frequency == pytest.approx(sqrt(GRAVITY / 1.8) / (2 * pi))
        assert np.abs(shape[0, :, 0]) == pytest.approx([1, 0, 0, 0, 0, 0], abs=1e-9)


def test_the_simulated_platform_in_guides_swings_as_often() -> None:
    """Simulated with stiff cables; its guides hold the rest."""
    exits = np.array([[-0.4, 0.0, 3.0], [0.4, 0.0, 3.0]])
    anchors = np.array([[-0.4, 0.1, 0.0], [0.4, 0.1, 0.0]])
    body = RigidBody(4.0, np.zeros(3), np.diag([0.1, 0.3, 0.3]), anchors, (1, 0, 1, 0, 1, 0))
    shifted = exits + np.array([0.0, 0.1, 0.0])
    pulleys = Pulleys(shifted, np.tile([0.0, 0.0, 1.0], (2, 1)), np.zeros(2))
    platform = CablePlatform(body, pulleys, np.array([0.0, 0.0, 1.2]), np.eye(3), 0.0)
    tension = platform.equilibrium(10.0)
    assert tension == pytest.approx([2.0 * GRAVITY] * 2)
    unstrained = (platform.length - tension / 1e6).tolist()
    platform.velocity = np.array([0.01, 0.0, 0.0, 0.0, 0.0, 0.0])
    x = []
    for k in range(1, 1201):
        platform.advance(0.005 * k, unstrained, unstrained, [1e6, 1e6])
        x.append(platform.position[0])
        assert platform.position[1] == 0.0
    turns = np.flatnonzero(np.diff(np.sign(x)) != 0)
    period = 2 * 0.005 * float(np.mean(np.diff(turns)))
    assert period == pytest.approx(2 * pi * sqrt(1.8 / GRAVITY), rel=0.01)


def test_what_a_rest_needs_is_named() -> None:
    light = replace(HANGING, platform=replace(HANGING.platform, mass=0.0))
    with pytest.raises(UsageError, match=r"needs \[platform\] mass"):
        rest_poses(light, light.home)
    two = robot_of(replace(HANGING.profile, line=HANGING.profile.line[:2]))
    with pytest.raises(UsageError, match="at least 3 do"):
        rest_poses(two, two.home)
    unknown = replace(HANGING, platform=replace(HANGING.platform, inertia=None))
    with pytest.raises(UsageError, match=r"need \[platform\] inertia"):
        pendulum_modes(unknown, HANGING.home, np.full((1, 4), 50.0))


def test_a_hanging_platform_is_planned_through_its_poses_of_rest() -> None:
    wiring = RobotWiring("hanging-4", speed=0.2, tension=(20.0, 500.0))
    limits = dict.fromkeys(HANGING.names, LimitSpec(speed=1.0, acceleration=5.0))
    planner = Planner(HANGING, wiring, limits)
    goal = Waypoint(np.array([0.5, 0.3, 1.0]), np.eye(3))
    (motion,) = planner.plan([goal], HANGING.home)
    found = HANGING.poses_at(motion.motor_angle[-1:], motion_end(motion.pose))
    assert found.pose.position[0] == pytest.approx([0.5, 0.3, 1.0], abs=1e-6)
    assert found.forces[0] == pytest.approx(motion.force[-1], abs=1e-3)
    assert np.ptp(motion.force[-1]) > 1.0, "it does not hang in the middle"


def motion_end(pose: Pose) -> Pose:
    return pose[-1:]
