"""Elongation of the cables of a moving platform, judged by a simulated one on elastic cables."""

from __future__ import annotations

import numpy as np

import ipanema3_live
from winchkit.catalog import find
from winchkit.robot import PLAIN, robot_of
from winchkit.schema.read import read_robot


def test_the_dynamic_wrench_leaves_a_tenth_of_the_error_of_rigid_cables() -> None:
    robot = robot_of(read_robot(find("profiles", "ipanema3")))
    rms = {}
    for method in ipanema3_live.METHODS:
        errors, _, least = ipanema3_live.moved(robot, method, 8.0, PLAIN)
        assert least > 0, "a slack cable"
        rms[method] = float(np.sqrt(np.mean(errors**2)))
    # 50 kg at 8 m/s^2 on cables whose common stiffness is about 50 kN/m: 8 mm.
    assert rms["rigid"] > rms["static"] > 5e-3
    assert rms["dynamic"] < 0.1 * rms["rigid"]
    # Strain at the reference, 1e-3, times the change of a cable's length, 1.3 m, is not corrected.
    assert rms["dynamic"] < 2e-3


def test_the_motion_returns_and_is_smooth() -> None:
    robot = robot_of(read_robot(find("profiles", "ipanema3")))
    position, rate, change = ipanema3_live.motion(robot, 5.0)
    step = ipanema3_live.PERIOD
    np.testing.assert_allclose(position[0], position[-1], atol=1e-9)
    np.testing.assert_allclose(np.gradient(position, step, axis=0), rate, atol=5e-3)
    np.testing.assert_allclose(np.gradient(rate, step, axis=0), change, atol=0.06)
