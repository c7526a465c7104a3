"""A robot's header in C is its model to rounding."""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

import export_tick
from winchkit import export_model, find
from winchkit.dynamics.c_code import identifier
from winchkit.dynamics.expression import OPERATIONS
from winchkit.errors import UsageError
from winchkit.model.rotation import quaternion_of, rotation_by
from winchkit.robot import ForceLimits, Pose
from winchkit.robot.dynamics.integration import ElasticCables, integrate
from winchkit.robot.effects.bind import robot_with_effects
from winchkit.robot.forces.force_distribution import closed_form, distributed_forces
from winchkit.robot.geometry.robot import Robot
from winchkit.schema.profiles.robot import RobotProfile
from winchkit.schema.profiles.winch import EffectTable, WinchProfile
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
SOFT = EffectTable("cable-elongation-linear", {"axial_stiffness": "20 kN"})
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
    """Length, structure matrix, wrench, forces, lengths by the model at the motor angles, and
    whether the forces are within the limits."""
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
    # Motor angles are an inverse: they are exact where the model has the asked lengths at them.
    parts[4] = robot_with_effects(profile).lengths_at(parts[4], parts[3])
    return parts


def by_python(profile: RobotProfile, pose: Pose) -> list[NDArray[np.float64]]:
    robot = robot_with_effects(profile)
    structure, wrench = robot.structure(pose), robot.weight(pose)
    limits = ForceLimits(LOW, HIGH)
    found = [closed_form(a, w, limits) for a, w in zip(structure, wrench, strict=True)]
    force = np.array([one.value for one in found])
    within = np.array([[float(one.feasible)] for one in found])
    lengths = robot.lengths(pose)
    return [lengths, structure, wrench, force, lengths, within]


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
def test_lines_whose_names_are_one_name_of_c_keep_their_winches(tmp_path: Path) -> None:
    """Names of C are in small letters, without signs."""
    profile = robot_profile("cabtive")
    own = EffectTable("drum-eccentricity", {"eccentricity": "3 mm", "phase": "2 rad"})
    lines = list(profile.line)
    for k, name in enumerate(("A", "a", "x-1", "x_1")):
        winch = lines[k].winch
        assert isinstance(winch, WinchProfile)
        winch = replace(winch, effect=(own,)) if k % 2 else winch
        lines[k] = replace(lines[k], name=name, winch=winch)
    profile = replace(profile, line=tuple(lines))
    pose = random_poses(robot_with_effects(profile), 20, 3)
    for found, other in zip(by_c(tmp_path, profile, pose), by_python(profile, pose), strict=True):
        assert np.max(np.abs(found - other)) <= 1e-12 * np.max(np.abs(other))


@pytest.mark.skipif(GCC is None, reason="gcc is not installed")
def test_the_benchmark_times_every_part_of_a_tick() -> None:
    found = export_tick.measured("cabtive", "float")
    assert set(found) == {*export_tick.PARTS, export_tick.WHOLE, export_tick.STEPS}
    assert all(0 < seconds < 1e-3 for seconds in found.values())


def movable(name: str) -> RobotProfile:
    """A robot whose every part has a counterpart in MuJoCo: drums of one radius, masses."""
    profile = read_robot(find("profiles", name))
    lines = []
    for line in profile.line:
        assert isinstance(line.winch, WinchProfile)
        drum = replace(line.winch.drum, kind="grooved", groove_pitch=0.0, layer_growth=None)
        effects = (EffectTable("rotor-inertia", {"inertia": "1 kg cm^2"}),)
        lines.append(replace(line, winch=replace(line.winch, drum=drum, effect=effects)))
    platform = replace(profile.platform, inertia=(0.012, 0.013, 0.016))
    return replace(profile, line=tuple(lines), platform=platform, effect=(SOFT,))


def turn_pulleys(data: Any, robot: Robot) -> None:
    """What the list of missing parts asks of the user's program."""
    axis = robot.geometry.swivel_axis
    anchor = np.array([data.site(f"anchor-{name}").xpos for name in robot.names])
    seen = anchor - data.mocap_pos
    outward = seen - np.sum(seen * axis, axis=1, keepdims=True) * axis
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    frame = np.stack([outward, np.cross(axis, outward), axis], axis=-1)
    data.mocap_quat[:] = quaternion_of(frame)


@pytest.mark.parametrize("pulleys", [True, False])
def test_mujoco_moves_the_platform_as_the_model(pulleys: bool) -> None:
    """Cables are wound for a path with forces about 60 N; 0.5 % of the platform's motion."""
    mujoco = pytest.importorskip("mujoco")
    profile = movable("cabtive")
    if not pulleys:
        fixed = tuple(replace(line, swivel_radius=0.0) for line in profile.line)
        profile = replace(profile, line=fixed)
    robot, found = robot_with_effects(profile), export_model(profile, "mjcf")
    assert len(found.missing) == (2 if pulleys else 1)
    assert found.missing[-1].startswith("change of a cable's stiffness")
    stiffness, damping_time = 2e4, 2e-3
    time = np.arange(0.0, 0.6, 2e-3)
    share = time / time[-1]
    path = 0.04 * share**3 * (10 - 15 * share + 6 * share**2)
    place = robot.home.position + path[:, None] * np.array([1.0, -0.5, 0.7])
    pose = Pose(place, np.repeat(robot.home.rotation, len(time), axis=0))
    force = distributed_forces(robot.structure(pose), robot.weight(pose), ForceLimits(20.0, 100.0))
    angles = robot.motor_angles(pose, strain=force / (stiffness + force))
    free, turned = CubicSpline(time, robot.lengths_at(angles)), CubicSpline(time, angles)
    cables = ElasticCables(np.full(8, stiffness), robot.dead_length, damping_time)
    wanted = integrate(
        robot.geometry, robot.platform, cables, (robot.home, np.zeros(6)), unstrained=free,
        rate=free.derivative(), time=time, tolerance=1e-5,
    )  # fmt: skip
    model = mujoco.MjModel.from_xml_string(found.text)
    model.tendon_damping[:] = damping_time * model.tendon_stiffness
    data = mujoco.MjData(model)
    arm = np.array([line.arm(0.0) for line in robot.lines])
    joints = [[model.joint(f"{of}-{n}") for n in robot.names] for of in ("drum", "cable")]
    places, speeds = ([[getattr(j, a)[0] for j in of] for of in joints]
                      for a in ("qposadr", "dofadr"))  # fmt: skip
    shown = []
    for now in time:
        while True:
            # The winches are where their motors are; cables, pulleys and platform are MuJoCo's.
            for of, at, order in ((data.qpos, places, 0), (data.qvel, speeds, 1)):
                of[at[0]] = turned(data.time, order)
                of[at[1]] = turned(data.time, order) * arm
            if data.time > now - model.opt.timestep / 2:
                break
            mujoco.mj_step(model, data)
        shown.append(data.joint("platform").qpos[:3].copy())
        if pulleys:
            turn_pulleys(data, robot)
    moved = np.max(np.linalg.norm(wanted.pose.position - robot.home.position, axis=1))
    off = np.linalg.norm(np.array(shown) - wanted.pose.position, axis=1)
    assert moved > 0.04
    assert np.max(off) < 5e-3 * moved


def test_a_robot_without_masses_or_stiffness_is_refused() -> None:
    bare = read_robot(find("profiles", "cabtive"))
    with pytest.raises(UsageError, match="has no mass that MuJoCo could move: write"):
        export_model(bare, "mjcf")
    with pytest.raises(UsageError, match="line 1: the stiffness of its cable is unknown"):
        export_model(replace(movable("cabtive"), effect=()), "mjcf")


def test_the_json_has_the_formulas_of_a_cable_and_of_its_winch() -> None:
    profile = robot_profile("cabtive")
    robot = robot_with_effects(profile)
    pose, found = random_poses(robot, 3, 8), export_model(profile, "json")
    # JSON has no number that is none; formulas of a cable have one, in a pulley.
    data = json.loads(found.text, parse_constant=pytest.fail)
    assert [one.split(":")[0] for one in found.missing] == ["force distribution"]
    assert data["lines"]["1"]["winch"]["profile"] == "cabtive-1"
    for i, (position, rotation) in enumerate(zip(pose.position, pose.rotation, strict=True)):
        for k, line in enumerate(data["lines"].values()):
            given = {"position": position, "rotation": rotation.ravel(), "at": line["at"]}
            known = {"NaN": np.nan}
            known |= {f"{n}[{j}]": float(x) for n, row in given.items() for j, x in enumerate(row)}
            for name, operation, *arguments in data["assignments"]:
                values = [known[a] if isinstance(a, str) else a for a in arguments]
                known[name] = OPERATIONS[operation].evaluate(*values)
            outputs = data["outputs"]
            assert known[outputs["length"]["value"]] == pytest.approx(robot.lengths(pose)[i, k])
            column = [known[one] for one in outputs["column"]["value"]]
            assert column == pytest.approx(robot.structure(pose)[i, :, k], abs=1e-12)


def test_too_few_cables_have_no_force_distribution() -> None:
    found = export_model(read_robot(find("profiles", "hanging-4")), "c")
    assert any(one.startswith("force distribution") for one in found.missing)
    assert "_forces(" not in found.text


def test_forms_that_a_robot_has_not_are_refused_by_name() -> None:
    profile = read_robot(find("profiles", "cabtive"))
    with pytest.raises(UsageError, match="is written as c, mjcf or json, not as 'python'"):
        export_model(profile, "python")
    with pytest.raises(UsageError, match="the mass on its cables is that of"):
        export_model(profile, "c", load_mass=3.0)
