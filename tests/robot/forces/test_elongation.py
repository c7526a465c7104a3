"""Elongation beside the kinematics: laws and forces, and a robot of springs that it puts right."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import root

from robot_cases import near, shipped
from winchkit.errors import UsageError
from winchkit.model.rotation import rotation_by
from winchkit.robot import (
    ElongationLaw,
    ExponentialLaw,
    LinearLaw,
    Pose,
    QuarticLaw,
    Robot,
    RobotCycle,
    approximate_forces,
    flat_pose,
    robot_of,
)
from winchkit.robot.dynamics.elongation_correction import ElongationCorrection

Array = np.ndarray
LINEAR = LinearLaw(439.13e3)
QUARTIC = QuarticLaw(3e5, 2e7, -1e8, 5e11)
EXPONENTIAL = ExponentialLaw(1500.0, -1.0)
LAWS = (LINEAR, QUARTIC, EXPONENTIAL)


def flat(pose: Pose, p: int) -> list[float]:
    return flat_pose(pose[p : p + 1])


def reference_forces(robot: Robot, middle: float = 500.0) -> Array:
    structure, weight = robot.structure(robot.home), robot.weight(robot.home)
    return approximate_forces(structure, weight, np.full(8, middle))[0]


@settings(deadline=None)
@given(st.sampled_from(LAWS), st.floats(0.0, 4e-3))
def test_strain_and_force_are_inverses(law: ElongationLaw, strain: float) -> None:
    assert law.strain(law.force(strain)) == pytest.approx(strain, abs=1e-12)


def test_laws_are_the_papers_equations() -> None:
    e = 1e-3
    assert LinearLaw(2e5, 30.0).force(e) == pytest.approx(2e5 * e + 30)
    assert QuarticLaw(1, 2, 3, 4, 5).force(2.0) == 4 * 16 + 3 * 8 + 2 * 4 + 1 * 2 + 5
    assert ExponentialLaw(1000.0, 7.0).force(e) == pytest.approx(np.exp(1) + 7)


def test_a_force_that_no_strain_gives_is_nan() -> None:
    assert np.isnan(ExponentialLaw(1000.0, 7.0).strain(7.0))
    assert np.isnan(QuarticLaw(1e5, k2=-1e8).strain(26.0))
    assert QuarticLaw(1e5, k2=-1e8).strain(24.0) == pytest.approx(4e-4)
    assert ExponentialLaw(1000.0).force(1.0) == np.inf
    for law in (LinearLaw, QuarticLaw, ExponentialLaw):
        with pytest.raises(UsageError, match="k1 of an elongation law is 0"):
            law(0.0)


@pytest.mark.parametrize("law", LAWS)
def test_correction_is_strain_between_here_and_the_reference(law: ElongationLaw) -> None:
    robot = shipped("ipanema3")
    initial = reference_forces(robot)
    correction = ElongationCorrection(robot, [law] * 8, robot.home, initial)
    poses = near(robot, 1, 10, 0.5)
    wrench = robot.weight(robot.home)
    forces = approximate_forces(robot.structure(poses), wrench, initial)
    lengths = robot.lengths(poses)
    at_home = correction.update(flat(robot.home, 0))
    np.testing.assert_allclose(at_home.length, 0.0, atol=1e-12)
    for p in range(10):
        found = correction.update(flat(poses, p))
        np.testing.assert_allclose(found.forces, forces[p], atol=1e-8)
        strain = [law.strain(f) - law.strain(i) for f, i in zip(forces[p], initial, strict=True)]
        np.testing.assert_allclose(found.strain, strain, atol=1e-12)
        np.testing.assert_allclose(found.length, strain * (lengths[p] + 5.0), atol=1e-11)
        assert found.good
        assert found.slack == bool((forces[p] < 0).any())


def elastic_pose(robot: Robot, motor_angles: Array, stiffness: float, initial: Array) -> Array:
    """Where a platform on linear springs rests, by solving six balances for six unknowns.

    The drums pay out cable that bears the reference's force; beyond that it stretches.
    """
    paid_out = robot.lengths_at(motor_angles)[0] + robot.dead_length

    def pose_of(step: Array) -> Pose:
        turn = rotation_by(step[3:]) @ robot.home.rotation
        return Pose(robot.home.position + step[:3], turn)

    def balance(step: Array) -> Array:
        pose = pose_of(step)
        stretch = robot.lengths(pose)[0] + robot.dead_length - paid_out
        force = initial + stiffness * stretch / paid_out
        return robot.structure(pose)[0] @ force + robot.weight(pose)[0]

    guess = robot.poses_at(motor_angles).pose.position[0] - robot.home.position[0]
    found = root(balance, np.append(guess, np.zeros(3)), tol=1e-12)
    assert np.abs(found.fun).max() < 1e-6
    return pose_of(found.x).position[0]


def test_a_robot_of_springs_comes_closer_to_where_it_was_sent() -> None:
    robot, stiffness = shipped("cabtive"), 5e3
    initial = reference_forces(robot, 60.0)
    correction = ElongationCorrection(robot, [LinearLaw(stiffness)] * 8, robot.home, initial)
    at_home = elastic_pose(robot, np.zeros((1, 8)), stiffness, initial)
    np.testing.assert_allclose(at_home, robot.home.position[0], atol=1e-9)
    for shift in ([0.0, 0.0, 0.2], [0.15, 0.1, 0.1], [-0.1, 0.2, -0.15], [0.2, -0.2, 0.0]):
        place = robot.home.position[0] + shift
        pose = Pose(place[None], np.eye(3)[None])
        plain = elastic_pose(robot, robot.motor_angles(pose), stiffness, initial)
        strain = np.array(correction.update(flat(pose, 0)).strain)
        better = elastic_pose(robot, robot.motor_angles(pose, strain), stiffness, initial)
        without, with_ = np.linalg.norm(plain - place), np.linalg.norm(better - place)
        assert without > 5e-4
        assert with_ < 0.1 * without


def test_taken_off_before_the_forward_kinematics_the_pose_comes_back() -> None:
    """Fig. 1: with δl on both sides neither kinematics knows of it."""
    robot = shipped("ipanema3")
    correction = ElongationCorrection.of(robot, middle_force=500.0)
    cycle, poses = RobotCycle(robot), near(robot, 2, 5, 0.5)
    for p in range(5):
        stretch = correction.update(flat(poses, p))
        angles = np.array(cycle.motor_angles(flat(poses, p), stretch.strain))
        drums = robot.lengths_at(angles)[0]
        found = cycle.pose_at([a + b for a, b in zip(drums, stretch.length, strict=True)])
        np.testing.assert_allclose(found, flat(poses, p), atol=1e-8)


def test_of_takes_stiffness_and_weight_from_the_profile() -> None:
    robot = shipped("ipanema3")
    there = near(robot, 3, 1, 0.5)
    ours = ElongationCorrection.of(robot, middle_force=500.0).update(flat(there, 0))
    initial = reference_forces(robot)
    by_hand = ElongationCorrection(robot, [LINEAR] * 8, robot.home, initial)
    np.testing.assert_allclose(ours.length, by_hand.update(flat(there, 0)).length, rtol=1e-12)
    with pytest.raises(UsageError, match=r"cabtive: line 1 has no cable\.axial_stiffness"):
        ElongationCorrection.of(shipped("cabtive"), middle_force=50.0)


def test_what_cannot_be_found_holds_the_last_good_correction() -> None:
    robot = shipped("ipanema3")
    correction = ElongationCorrection.of(robot, middle_force=500.0)
    good = correction.update(flat(near(robot, 4, 1, 0.5), 0))
    lost = correction.update([float("nan")] * 12)
    assert not lost.good
    assert lost.length == good.length
    assert correction.update(flat(robot.home, 0)).good


def test_a_law_without_strain_for_a_force_says_so() -> None:
    robot = shipped("ipanema3")
    initial = reference_forces(robot)
    laws: list[ElongationLaw] = [LINEAR] * 7 + [ExponentialLaw(1000.0, 600.0)]
    with pytest.raises(UsageError, match=r"line 8: its elongation law has no strain for 4\d\d"):
        ElongationCorrection(robot, laws, robot.home, initial)
    above = ElongationCorrection(robot, [ExponentialLaw(1000.0, 300.0)] * 8, robot.home, initial)
    high = Pose(np.array([[0.0, 0.0, 2.0]]), np.eye(3)[None])
    assert not above.update(flat(high, 0)).good


def test_numbers_that_do_not_fit_are_refused() -> None:
    robot = shipped("ipanema3")
    with pytest.raises(UsageError, match="7 laws were given for a robot of 8 lines"):
        ElongationCorrection(robot, [LINEAR] * 7, robot.home, [500.0] * 8)
    with pytest.raises(UsageError, match="3 initial forces"):
        ElongationCorrection(robot, [LINEAR] * 8, robot.home, [500.0] * 3)
    four = robot_of(replace(robot.profile, line=robot.profile.line[:4]))
    with pytest.raises(UsageError, match="at least 6"):
        ElongationCorrection(four, [LINEAR] * 4, robot.home, [500.0] * 4)
    flat_one = replace(robot, geometry=replace(robot.geometry, anchor_point=np.zeros((8, 3))))
    with pytest.raises(UsageError, match="structure matrix is singular"):
        ElongationCorrection(flat_one, [LINEAR] * 8, robot.home, [500.0] * 8)
