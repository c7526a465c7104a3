"""A robot's header in C is its model to rounding."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from winchkit import export_model, find
from winchkit.dynamics.c_code import identifier
from winchkit.errors import UsageError
from winchkit.model.rotation import rotation_by
from winchkit.robot import ForceLimits, Pose
from winchkit.robot.effects.bind import robot_with_effects
from winchkit.robot.forces.force_distribution import closed_form
from winchkit.robot.geometry.robot import Robot
from winchkit.schema.profiles.robot import RobotProfile
from winchkit.schema.profiles.winch import EffectTable
from winchkit.schema.read import read_robot

GCC = shutil.which("gcc")
FLAGS = ["-std=c99", "-O1", "-Wall", "-Wextra", "-Werror", "-fsanitize=address,undefined"]
MAIN = """\
#include "robot.h"
#include <stdio.h>

int main(void)
{
    NAME_pose pose;
    NAME_real length[LINES], structure[6 * LINES], wrench[6], force[LINES], angle[LINES];
    NAME_real low[LINES], high[LINES], within;
    for (int i = 0; i < LINES; ++i) {
        low[i] = LOW;
        high[i] = HIGH;
    }
    while (fread(&pose, sizeof pose, 1, stdin) == 1) {
        NAME_lengths(&pose, length, structure);
        NAME_weight(&pose, wrench);
        within = NAME_forces(structure, wrench, low, high, force);
        NAME_motor_angles(length, force, angle);
        fwrite(length, sizeof length, 1, stdout);
        fwrite(structure, sizeof structure, 1, stdout);
        fwrite(wrench, sizeof wrench, 1, stdout);
        fwrite(force, sizeof force, 1, stdout);
        fwrite(angle, sizeof angle, 1, stdout);
        fwrite(&within, sizeof within, 1, stdout);
    }
    return 0;
}
"""
LOW, HIGH = 5.0, 200.0
ELASTIC = EffectTable("cable-elongation-linear", {"axial_stiffness": "400 kN"})
ROUND = EffectTable("drum-eccentricity", {"eccentricity": "0.5 mm", "phase": "1 rad"})


def robot_profile(name: str) -> RobotProfile:
    """A shipped robot with an elastic cable and, on each winch, an eccentric drum."""
    profile = read_robot(find("profiles", name))
    lines = tuple(
        replace(line, winch=replace(line.winch, effect=(ROUND,))) for line in profile.line
    )
    return replace(profile, line=lines, effect=(ELASTIC,))


def random_poses(robot: Robot, count: int, seed: int) -> Pose:
    """Around home, far from singular poses, in which rounding decides the forces."""
    random, size = np.random.default_rng(seed), robot.geometry.size
    place = robot.home.position + 0.05 * size * random.uniform(-1, 1, (count, 3))
    turned = rotation_by(random.uniform(-0.1, 0.1, (count, 3)))
    return robot.guided(Pose(place, turned @ robot.home.rotation[0]))


def by_c(
    folder: Path, profile: RobotProfile, pose: Pose, real: str = "double"
) -> list[NDArray[np.float64]]:
    """Length, structure matrix, wrench, forces, angles and whether they are within the limits."""
    count, name = len(profile.line), identifier(profile.name)
    (folder / "robot.h").write_text(export_model(profile, "c").text)
    main = MAIN.replace("NAME", name).replace("LINES", str(count))
    (folder / "main.c").write_text(main.replace("LOW", str(LOW)).replace("HIGH", str(HIGH)))
    defined = ["-DWINCHKIT_FLOAT"] if real == "float" else []
    command = ["gcc", *FLAGS, *defined, "main.c", "-lm", "-o", "robot"]
    subprocess.run(command, cwd=folder, check=True)
    kind = np.dtype(np.float32 if real == "float" else np.float64)
    sent = np.hstack([pose.position, pose.rotation.reshape(-1, 9)]).astype(kind).tobytes()
    found = subprocess.run([folder / "robot"], input=sent, capture_output=True, check=True)
    rows = np.frombuffer(found.stdout, kind).astype(float).reshape(len(pose.position), -1)
    widths = np.cumsum([count, 6 * count, 6, count, count])
    parts = np.split(rows, widths, axis=1)
    parts[1] = parts[1].reshape(-1, count, 6).transpose(0, 2, 1)
    return parts


def by_python(profile: RobotProfile, pose: Pose) -> list[NDArray[np.float64]]:
    robot = robot_with_effects(profile)
    structure, wrench = robot.structure(pose), robot.weight(pose)
    limits = ForceLimits(LOW, HIGH)
    found = [closed_form(a, w, limits) for a, w in zip(structure, wrench, strict=True)]
    force = np.array([one.value for one in found])
    within = np.array([[float(one.feasible)] for one in found])
    angles = robot.motor_angles(pose, tension=force)
    return [robot.lengths(pose), structure, wrench, force, angles, within]


@pytest.mark.skipif(GCC is None, reason="gcc is not installed")
@pytest.mark.parametrize("name", ["cabtive", "ipanema3", "winding-device-8"])
@pytest.mark.parametrize("count", [2000, pytest.param(1_000_000, marks=pytest.mark.campaign)])
def test_the_compiled_header_is_the_robot(tmp_path: Path, name: str, count: int) -> None:
    profile = robot_profile(name)
    pose = random_poses(robot_with_effects(profile), count, 1)
    expected = by_python(profile, pose)
    for own, other in zip(by_c(tmp_path, profile, pose), expected, strict=True):
        assert np.all(np.isfinite(other))
        assert np.max(np.abs(own - other)) <= 1e-12 * np.max(np.abs(other))
    exact = Pose(*(x.astype(np.float32).astype(float) for x in (pose.position, pose.rotation)))
    some = exact[:200]
    wanted = by_python(profile, some)[:-1]
    for own, other in zip(by_c(tmp_path, profile, some, "float"), wanted, strict=False):
        assert np.max(np.abs(own - other)) <= 1e-5 * np.max(np.abs(other))


@pytest.mark.skipif(GCC is None, reason="gcc is not installed")
def test_effects_move_the_exported_angles(tmp_path: Path) -> None:
    """Without its effects the header has other motor angles: they are in it."""
    profile = robot_profile("cabtive")
    pose = random_poses(robot_with_effects(profile), 20, 2)
    bare = read_robot(find("profiles", "cabtive"))
    with_effects, without = (by_c(tmp_path, one, pose)[4] for one in (profile, bare))
    assert np.min(np.max(np.abs(with_effects - without), axis=1)) > 1e-5


def test_too_few_cables_have_no_force_distribution() -> None:
    found = export_model(read_robot(find("profiles", "hanging-4")), "c")
    assert any(one.startswith("force distribution") for one in found.missing)
    assert "_forces(" not in found.text


def test_forms_that_a_robot_has_not_are_refused_by_name() -> None:
    profile = read_robot(find("profiles", "cabtive"))
    with pytest.raises(UsageError, match="is written as c or mjcf, not as 'python'"):
        export_model(profile, "python")
    with pytest.raises(UsageError, match="the mass on its cables is that of"):
        export_model(profile, "c", load_mass=3.0)
