"""Profiles far from the robot: points 100 mm off, a home that is not known, in either frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from robot_cases import shipped
from robot_poses.mistaken import Scene, Table, profile_text, recorded
from winchkit.robot import Pose, calibrate, robot_of
from winchkit.robot.calibration.calibrate import Calibrated
from winchkit.robot.calibration.prediction import rms
from winchkit.robot.files.poses import read_poses
from winchkit.runs import read_run
from winchkit.schema.profiles.robot import HomeSpec, LineSpec, PlatformSpec, RobotProfile
from winchkit.schema.read import read_robot

SEED = 471
FLOOR = {"cabtive": 1.3e-4, "winding-device-8": 4e-4}
"""Held-out error of these scenes with the right start and a margin, m: 0.05 mm of cable noise."""
DRUM = {"cabtive": 0.060, "winding-device-8": 0.050 / 30}
"""Winding radius over gear ratio, m."""

Change = Callable[[RobotProfile, np.random.Generator], RobotProfile]


def off(rng: np.random.Generator, size: float) -> tuple[float, float, float]:
    """A displacement of a length in a random direction."""
    step = rng.normal(size=3)
    x, y, z = (size * step / np.linalg.norm(step)).tolist()
    return x, y, z


def points(name: str) -> Change:
    """The profile with all of these points 100 mm off."""

    def changed(profile: RobotProfile, rng: np.random.Generator) -> RobotProfile:
        def line(own: LineSpec) -> LineSpec:
            moved: dict[str, Any] = {name: tuple(np.add(getattr(own, name), off(rng, 0.1)))}
            return replace(own, **moved)

        return replace(profile, line=tuple(map(line, profile.line)))

    return changed


def home(profile: RobotProfile, rng: np.random.Generator) -> RobotProfile:
    """The profile with the home pose 100 mm off."""
    x, y, z = np.add(profile.home.position, off(rng, 0.1)).tolist()
    return replace(profile, home=replace(profile.home, position=(x, y, z)))


def calibrated(folder: Path, scene: Scene, table: Table, change: Change) -> Calibrated:
    run, path = folder / "poses.csv", folder / "robot.toml"
    run.write_text(table.csv())
    path.write_text(profile_text(scene.robot, known_frame=scene.known_frame))
    profile = change(read_robot(path), np.random.default_rng(SEED))
    return calibrate(robot_of(profile), read_poses([read_run(run)], profile))


@pytest.mark.parametrize("known", [True, False], ids=["known frame", "unknown frame"])
@pytest.mark.parametrize("change", [points("exit_point"), points("anchor_point"), home])
def test_a_start_100_mm_off_ends_at_the_noise(tmp_path: Path, change: Change, known: bool) -> None:
    scene = Scene("cabtive", known, False, 90, 2e-5, 2e-3, SEED)
    found = calibrated(tmp_path, scene, recorded(scene), change)
    assert rms(found.validation_after.distance) < FLOOR["cabtive"]
    assert found.refusal == ""
    if change is not home:
        assert any("points are up to" in text for text in found.warnings)


@pytest.mark.parametrize("robot", ["cabtive", "winding-device-8"])
def test_lengths_at_home_are_found_in_an_unknown_frame(tmp_path: Path, robot: str) -> None:
    scene = Scene(robot, False, False, 90, 2e-5, 2e-3, SEED)
    table = recorded(scene)
    angle = np.random.default_rng(SEED).uniform(-0.1, 0.1, table.motor.shape[1]) / DRUM[robot]
    table = replace(table, motor=table.motor + angle)
    found = calibrated(tmp_path, scene, table, lambda profile, rng: profile)
    assert rms(found.validation_after.distance) < 2 * FLOOR[robot]
    assert found.refusal == ""
    assert any("other cable lengths at home" in text for text in found.warnings)


def test_what_no_pose_determines_stays_where_the_file_has_it(tmp_path: Path) -> None:
    """A point mass on four cables, without positions: one spare length per pose. All motor angles
    of the other sign led to exit points twenty metres away, which were written."""
    given = shipped("hanging-4").profile
    exits = ((0.0, -1.1, -0.1), (1.0, 0.55, -0.1), (-1.0, 0.55, -0.1), (0.0, 0.0, 2.9))
    lines = tuple(
        replace(line, exit_point=at, anchor_point=(0.0, 0.0, 0.0), swivel_radius=0.0)
        for line, at in zip(given.line, exits, strict=True)
    )
    point = PlatformSpec(degrees_of_freedom=("x", "y", "z"))
    home = HomeSpec((0.0, 0.0, 0.0))
    robot = robot_of(replace(given, platform=point, line=lines, home=home))
    position = np.random.default_rng(4).uniform([-0.5, -0.5, 0.1], [0.5, 0.5, 0.9], (10, 3))
    angles = -robot.motor_angles(Pose(position, np.tile(np.eye(3), (10, 1, 1))))
    rows = "\n".join(",".join(map(repr, row)) for row in angles.tolist())
    run = tmp_path / "poses.csv"
    run.write_text(",".join(f"{n}.motor_angle [rad]" for n in robot.names) + f"\n{rows}\n")
    found = calibrate(robot, read_poses([read_run(run)], robot.profile))
    assert "in combinations that the poses do not determine" in found.refusal
