"""Logs of a robot in motion, made by benchmarks/robot_poses/moving.py."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from model_files import answer
from robot_poses.hidden import BASE, profile_text
from robot_poses.moving import log
from small_robots import RADIUS, RATIO, small_robot
from winchkit.diagnosis.data.spectrum import smoothed
from winchkit.model.smoothing_spline import SmoothingSpline
from winchkit.robot import Pose, rotation_of
from winchkit.robot.diagnosis.compare import compared
from winchkit.robot.diagnosis.errors import rms
from winchkit.robot.dynamics.smoothed_motion import smoothed_motion
from winchkit.robot.geometry.tracker import Tracker
from winchkit.runs import read_run

DELAY = 0.02
DRUM = 3e-4
"""Error of the third winding radius, 0.5 %, m."""
Folder = Callable[[str], Path]


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("robot")
    (folder / "robot.toml").write_text(profile_text())
    (folder / "declared.toml").write_text(
        profile_text() + '\n[instrument.tracker]\ndelay = "20 ms"\n'
    )
    winding = list(BASE.winding)
    winding[2] += DRUM
    log(folder / "drum.csv", truth=replace(BASE, winding=tuple(winding)), count=160)
    log(folder / "late.csv", delay=DELAY, count=60)
    return folder


def test_uniform_motion_and_uniform_acceleration_have_their_derivatives() -> None:
    time = np.arange(100) * 0.02
    position = np.stack([0.1 * time, 0.05 * time**2, 0 * time], axis=1)
    pose = Pose(position, rotation_of(0.3 * time, 0 * time, 0 * time))
    motion, _, _ = smoothed_motion(SmoothingSpline.fit(time, position[:, 1]), pose)
    inner = slice(10, -10)
    np.testing.assert_allclose(motion.velocity[inner, 0], 0.1, atol=1e-6)
    np.testing.assert_allclose(motion.velocity[inner, 3], 0.3, atol=1e-6)
    np.testing.assert_allclose(motion.acceleration[inner, 1], 0.1, atol=1e-4)


def test_a_delay_alone_makes_a_tracker_differ_from_the_base_frame() -> None:
    assert Tracker.at(np.zeros(3)).is_trivial
    assert not Tracker(np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), delay=0.01).is_trivial


def test_bands_without_degrees_of_freedom_have_the_variance_of_their_neighbours() -> None:
    power = np.array([9.0, 0.1, 9.0, 2.0, 2.0, 2.0])
    level, freedom = smoothed(power, np.array([1e-3, 1e-3, 1e-3, 300.0, 300.0, 300.0]), order=1)
    np.testing.assert_allclose(level, 2.0, rtol=0.02)
    # A random walk of steps of 0.25 in ln σ²: three steps have the variance 3 · 0.25².
    assert freedom[0] == pytest.approx(2 / (3 * 0.25**2), rel=0.15)


def test_a_drum_of_one_winch_is_named_and_the_error_falls(robot: Path) -> None:
    found = answer("diagnose", robot / "drum.csv", "-p", robot / "robot.toml")
    assert (found["verdict"], found["geometry"]) == ("explained", "file")
    (step,) = found["steps"]
    # Layers of one turn: radius and ratio differ by the growth of the layers alone.
    assert set(step["effects"]) <= {"drum-radius", "gear-ratio"}
    assert {line for lines in step["lines"].values() for line in lines} == {"3"}
    for effect, truth in (("drum-radius", DRUM), ("gear-ratio", -DRUM / BASE.winding[2])):
        for value in step["parameters"].get(effect, {}).values():
            assert value["value"] == pytest.approx(truth, rel=0.05)
    place = found["outputs"]["platform_position"]
    # A tracker of 0.02 mm per axis.
    assert place["heldout_rms_after"] < 5e-5 < place["heldout_rms_before"]


def test_the_delay_of_a_tracker_is_fitted_and_written(robot: Path) -> None:
    run, profile, better = (robot / name for name in ("late.csv", "robot.toml", "better.toml"))
    added = answer("add", "tracker-delay", "--fit", run, "-p", profile, "-o", better)
    delay = added["parameters"]["tracker-delay"]["delay"]
    assert abs(delay["value"] - DELAY) < max(4 * delay["std"], 2e-4)
    assert "tracker-delay" in better.read_text()


def test_a_declared_delay_is_corrected(robot: Path) -> None:
    before, after = (
        answer("compare", robot / "late.csv", "-p", robot / name)
        for name in ("robot.toml", "declared.toml")
    )
    rms = [one["outputs"]["platform_position"]["rms"] for one in (before, after)]
    assert rms[1] < 5e-5 < 10 * rms[1] < rms[0]


def test_forces_of_a_point_mass_in_motion_carry_its_weight_and_inertia(tmp_path: Path) -> None:
    """Three of the six components of the wrench are those of cables at every pose."""
    exits = np.array([(0, 0, 2.5), (3, 0, 2.5), (3, 2.5, 2.5), (0, 2.5, 2.5), (1.5, 1.2, 0)], float)
    home, size, mass, noise = np.array((1.5, 1.25, 1.0)), np.array((0.3, 0.2, 0.2)), 4.0, 0.1
    rng, time = np.random.default_rng(4), np.arange(300) / 50
    rate = 2 * np.pi * np.array((0.3, 0.2, 0.25))
    position = home + size * np.sin(time[:, None] * rate)
    force = mass * (-size * rate**2 * np.sin(time[:, None] * rate) + (0.0, 0.0, 9.80665))
    away = exits - position[:, None]
    length = np.linalg.norm(away, axis=2)
    pull = np.swapaxes(away / length[..., None], 1, 2)
    inverse = np.linalg.pinv(pull)
    tension = 40 + (inverse @ (force - 40 * pull.sum(axis=2))[..., None])[..., 0]
    motor = (np.linalg.norm(exits - home, axis=1) - length) / RADIUS * RATIO
    columns = [time[:, None], motor, tension + rng.normal(0, noise, tension.shape), position]
    names = ["time [s]", *(f"{k + 1}.motor_angle [rad]" for k in range(5))]
    names += [*(f"{k + 1}.tension [N]" for k in range(5)), *(f"platform_{a} [m]" for a in "xyz")]
    rows = np.concatenate(columns, axis=1).tolist()
    path = tmp_path / "log.csv"
    path.write_text("\n".join([",".join(names), *(",".join(map(repr, r)) for r in rows)]) + "\n")
    points = [tuple(point) for point in exits.tolist()]
    robot = small_robot(points, [(0.0, 0.0, 0.0)] * 5, ("x", "y", "z"), home=tuple(home.tolist()))
    error = compared([read_run(path)], robot.profile).errors["tension"]
    assert np.isfinite(error).all()
    assert rms("tension", error) < 2 * noise
