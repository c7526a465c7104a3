"""A platform on four cables that swings while its motors turn slowly: closed form of a sine."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from winchkit.robot.diagnosis.dataset import prepare_poses
from winchkit.runs.read import read_run
from winchkit.schema.read import read_robot

SWAY, RATE, HERTZ = 0.02, 50.0, 0.5
"""Amplitude of x, m; rows per second; frequency of the swing, Hz."""


def test_the_inertial_force_of_a_swing_is_that_of_the_measured_motion(tmp_path: Path) -> None:
    """Until now it was that of the pose of equilibrium with these cables, which does not swing."""
    time = np.arange(1000) / RATE
    random = np.random.default_rng(3)
    phase = 2 * np.pi * HERTZ * time
    columns = {
        "time [s]": time,
        # All cables 5 mm shorter in 20 s, so that the log is a motion.
        **{f"{i}.motor_angle [rad]": 0.15 * time for i in range(1, 5)},
        **{f"{i}.tension [N]": 77 + random.normal(0, 0.5, 1000) for i in range(1, 5)},
        "platform_x [m]": SWAY * np.sin(phase) + random.normal(0, 5e-5, 1000),
        "platform_y [m]": random.normal(0, 5e-5, 1000),
        "platform_z [m]": 0.8 + random.normal(0, 5e-5, 1000),
        **{f"platform_{a} [rad]": random.normal(0, 1e-4, 1000) for a in ("roll", "pitch", "yaw")},
    }
    path = tmp_path / "swing.csv"
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, delimiter=",", header=",".join(columns), comments="", fmt="%.9g")
    profile = read_robot("hanging-4")
    motion = prepare_poses([read_run(path)], profile).trajectory
    assert motion is not None
    wrench = motion.inertial_wrench(profile.platform)
    omega = 2 * np.pi * HERTZ
    expected = profile.platform.mass * SWAY * omega**2 * np.sin(omega * motion.time)
    assert np.abs(expected).max() == pytest.approx(3.95, abs=0.05)
    inner = slice(3, -3)
    np.testing.assert_allclose(wrench[inner, 0], expected[inner], atol=0.6)
    assert np.corrcoef(wrench[inner, 0], expected[inner])[0, 1] > 0.99
    assert np.std(wrench[inner, 1]) < 0.4
