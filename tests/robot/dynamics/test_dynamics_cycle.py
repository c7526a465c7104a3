"""Dynamics of one pose per cycle against the batched equations, plain and compiled."""

from __future__ import annotations

from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest

from robot_cases import near, shipped
from winchkit.errors import UsageError
from winchkit.model.rotation import rotation_by
from winchkit.model.stages import Signals
from winchkit.robot import (
    PLAIN,
    DynamicsCycle,
    LinearLaw,
    Pose,
    RobotKernels,
    approximate_forces,
    compiled,
    flat_pose,
)
from winchkit.robot.dynamics.dynamics import PlatformMotion, dynamic_wrench, motion_of
from winchkit.robot.dynamics.elongation_correction import ElongationCorrection
from winchkit.schema.profiles.robot import PlatformSpec

BODY = PlatformSpec(12.0, (0.02, -0.01, 0.05), (0.3, 0.4, 0.5))
ROBOT = replace(shipped("cabtive"), platform=BODY)
MIDDLE = np.full(8, 100.0)


@pytest.fixture(scope="module", params=["plain", pytest.param("numba", marks=pytest.mark.slow)])
def kernels(request: pytest.FixtureRequest) -> RobotKernels:
    if request.param == "plain":
        return PLAIN
    if not find_spec("numba"):
        pytest.skip("numba is not installed")
    return compiled()


def test_a_cycle_is_the_batched_inverse_dynamics(kernels: RobotKernels) -> None:
    rng = np.random.default_rng(3)
    pose = near(ROBOT, 5, 20)
    motion = PlatformMotion(pose, rng.normal(size=(20, 6)), rng.normal(size=(20, 6)))
    wrench = dynamic_wrench(BODY, motion)
    force = approximate_forces(ROBOT.structure(pose), wrench, MIDDLE)
    angle = ROBOT.motor_angles(pose)
    cycle = DynamicsCycle(ROBOT, MIDDLE, 1e-3, inertia=np.zeros(8), kernels=kernels)
    for k in range(20):
        found = cycle.update(
            kernels.array(flat_pose(pose[k : k + 1])),
            kernels.array(motion.velocity[k].tolist()),
            kernels.array(motion.acceleration[k].tolist()),
        )
        assert found.good
        np.testing.assert_allclose(found.force, force[k], rtol=1e-8)
        np.testing.assert_allclose(found.motor_angle, angle[k], rtol=1e-10)
        arm = [line.arm(a) for line, a in zip(ROBOT.lines, angle[k], strict=True)]
        np.testing.assert_allclose(found.motor_torque, force[k] * arm, rtol=1e-6)


def test_inertia_of_the_winches_takes_the_torque_of_their_acceleration() -> None:
    period, inertia = 1e-3, 4e-4
    time = np.arange(300) * period
    pose = Pose(
        ROBOT.home.position + 0.05 * np.sin(8 * time)[:, None] * np.array([1.0, 0.4, -0.3]),
        rotation_by(0.1 * np.sin(6 * time)[:, None] * np.array([0.2, 0.1, 0.5]))
        @ ROBOT.home.rotation,
    )
    motion, angle = motion_of(time, pose), ROBOT.motor_angles(pose)
    added = []
    cycles = [DynamicsCycle(ROBOT, MIDDLE, period, inertia=np.full(8, j)) for j in (0.0, inertia)]
    for k in range(300):
        at = flat_pose(pose[k : k + 1])
        rates = motion.velocity[k].tolist(), motion.acceleration[k].tolist()
        without, with_inertia = (list(c.update(at, *rates).motor_torque) for c in cycles)
        added.append(np.subtract(with_inertia, without))
    line = ROBOT.lines[2]
    at_motor = line.motion(Signals(time=time, motor_angle=angle[:, 2])).at.motor_acceleration
    half_a_period_earlier = (at_motor[19:279] + at_motor[20:280]) / 2
    shown = np.array(added)[20:280, 2]
    size = np.max(np.abs(shown))
    np.testing.assert_allclose(shown, inertia * half_a_period_earlier, atol=2e-3 * size)
    assert np.all(added[0] == 0.0), "no speed before the first cycle"


def test_elongation_on_a_moving_platform_is_that_of_its_dynamic_forces() -> None:
    stiffness = 1e5
    initial = approximate_forces(ROBOT.structure(ROBOT.home), ROBOT.weight(ROBOT.home), MIDDLE)[0]
    correction = ElongationCorrection(ROBOT, [LinearLaw(stiffness)] * 8, ROBOT.home, initial)
    cycle = DynamicsCycle(ROBOT, initial, 1e-3)
    pose, gain = flat_pose(ROBOT.home), [2.0, 0.0, 3.0, 0.0, 0.0, 1.0]
    at_rest = correction.update(pose)
    moving = correction.update(pose, cycle.wrench(pose, [0.0] * 6, gain))
    motion = PlatformMotion(ROBOT.home, np.zeros((1, 6)), np.array([gain]))
    force = approximate_forces(ROBOT.structure(ROBOT.home), dynamic_wrench(BODY, motion), initial)[
        0
    ]
    np.testing.assert_allclose(at_rest.strain, 0.0, atol=1e-15)
    np.testing.assert_allclose(moving.strain, (force - initial) / stiffness, rtol=1e-9)


def test_a_cycle_refuses_what_does_not_fit() -> None:
    with pytest.raises(UsageError, match="above 0"):
        DynamicsCycle(ROBOT, MIDDLE, 0.0)
    with pytest.raises(UsageError, match="3 initial forces"):
        DynamicsCycle(ROBOT, MIDDLE[:3], 1e-3)
