"""Mistakes in tables of poses, made by a generator that shares no code with winchkit's geometry."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import robot_mistakes
from robot_poses.mistaken import KINDS, Scene, mistake_of, profile_text, recorded
from small_robots import RADIUS, RATIO, small_robot
from winchkit.arrays import Array
from winchkit.errors import RunError
from winchkit.robot import calibrate, robot_of
from winchkit.robot.files.poses import MeasuredPoses, read_poses
from winchkit.robot.mistakes.search import mistakes_in, refuse_mistakes
from winchkit.runs import read_run
from winchkit.schema.read import read_robot

LINES = 8
SCENE = Scene("winding-device-8", True, True, 60, 1e-4, 5e-3, 11)
"""A robot of 6 m with points 5 mm off, and a tracker of 0.1 mm."""


def written(folder: Path, text: str, scene: Scene = SCENE) -> tuple[Path, Path]:
    run, profile = folder / "poses.csv", folder / "robot.toml"
    run.write_text(text)
    profile.write_text(profile_text(scene.robot, known_frame=scene.known_frame))
    return run, profile


def found(folder: Path, text: str) -> list[str]:
    """Codes of the mistakes in a table."""
    run, path = written(folder, text)
    profile = read_robot(path)
    return [n.code for n in mistakes_in(robot_of(profile), read_poses([read_run(run)], profile))]


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_of_mistake_is_named_alone(kind: str, tmp_path: Path) -> None:
    mistake = mistake_of(kind, 5, LINES)
    codes = found(tmp_path, mistake.apply(recorded(SCENE)).csv())
    assert len(codes) == 1
    assert mistake.codes & set(codes[0].split(" | "))


@pytest.mark.parametrize("rows", [-7, 11])
def test_a_table_that_begins_later_is_named(rows: int, tmp_path: Path) -> None:
    """The first poses of one table are missing, and the last ones of the other."""
    t, count = recorded(SCENE), abs(rows)
    early, late = slice(None, -count), slice(count, None)
    motor, pose = (early, late) if rows > 0 else (late, early)
    table = replace(t, motor=t.motor[motor], position=t.position[pose], angles=t.angles[pose])
    assert found(tmp_path, table.csv()) == [f"rows:{rows}"]


@pytest.mark.parametrize(
    ("factors", "code"),
    [((1.0, 1.0, -1.0), "rotation-sign:yaw"), ((10 / 9,) * 3, "rotation-unit:gon")],
)
def test_signs_and_gon_of_rotations_are_named(
    factors: tuple[float, ...], code: str, tmp_path: Path
) -> None:
    table = recorded(SCENE)
    assert found(tmp_path, replace(table, angles=table.angles * factors).csv()) == [code]


@pytest.mark.parametrize("oriented", [True, False])
def test_a_cable_that_slips_is_named_with_its_row(oriented: bool, tmp_path: Path) -> None:
    """Also where the fit would take it for noise."""
    motor = recorded(SCENE).motor.copy()
    motor[24:, 4] += 0.008 * RATIO / RADIUS
    table = replace(recorded(SCENE), motor=motor, oriented=oriented)
    run, path = written(tmp_path, table.csv())
    profile = read_robot(path)
    with pytest.raises(RunError) as refused:
        calibrate(robot_of(profile), read_poses([read_run(run)], profile))
    (fault,) = refused.value.faults
    assert fault.key == "motor-slip:5"
    assert f"from row 25 of {run} on the cable of line 5 is" in fault.message


@pytest.mark.slow
def test_two_mistakes_are_named_together(tmp_path: Path) -> None:
    first, second = mistake_of("swap", 3, LINES), mistake_of("shift", 4, LINES)
    (code,) = found(tmp_path, second.apply(first.apply(recorded(SCENE))).csv())
    assert code.split(" + ") == [*first.codes, *second.codes]


def test_what_a_calibration_is_for_is_no_mistake(tmp_path: Path) -> None:
    for scene in (SCENE, replace(SCENE, geometry=0.015, tracker=5e-4, seed=12)):
        assert found(tmp_path, recorded(scene).csv()) == []


@pytest.mark.slow
def test_rows_that_do_not_belong_together_are_refused(tmp_path: Path) -> None:
    table = recorded(SCENE)
    order = np.random.default_rng(1).permutation(SCENE.poses)
    shuffled = replace(table, position=table.position[order], oriented=False)
    assert found(tmp_path, shuffled.csv()) == ["poses-unlike"]


def test_rotations_that_the_cables_hardly_hold_are_those_of_the_poses(tmp_path: Path) -> None:
    """Cables that run through the middle of a platform hold two angles."""
    exits = ((-0.5, -0.4, 0.0), (0.5, -0.4, 0.0), (0.5, 0.4, 0.0), (-0.5, 0.4, 0.0))
    anchors = ((-0.05, -0.05, 0.0), (0.05, -0.05, 0.0), (0.05, 0.05, 0.0), (-0.05, 0.05, 0.0))
    robot = small_robot(exits, anchors, ("x", "y", "yaw"), home=(0.0, 0.0, 0.0))
    rng = np.random.default_rng(5)
    offset = rng.normal(0, 4e-3, (2, 4, 3))
    e, b = np.array(exits) + offset[0], np.array(anchors) + offset[1]

    def length(x: float, y: float, yaw: float) -> Array:
        away = x + b[:, 0] * np.cos(yaw) - b[:, 1] * np.sin(yaw) - e[:, 0]
        aside = y + b[:, 0] * np.sin(yaw) + b[:, 1] * np.cos(yaw) - e[:, 1]
        return np.asarray(np.hypot(away, aside))

    columns = [*(f"{n}.motor_angle [rad]" for n in robot.names), "platform_x [m]"]
    columns += ["platform_y [m]", *(f"platform_{a} [rad]" for a in ("roll", "pitch", "yaw"))]
    lines = [",".join(columns)]
    for x, y, yaw in rng.uniform([-0.15, -0.15, -0.3], [0.15, 0.15, 0.3], (20, 3)).tolist():
        motor = (length(0.0, 0.0, 0.0) - length(x, y, yaw)) / RADIUS * RATIO
        seen = np.array([x, y, yaw]) + rng.normal(0, [3e-5, 3e-5, 2e-4])
        lines.append(",".join(map(str, [*motor, *seen[:2], 0.0, 0.0, seen[2]])))
    path = tmp_path / "poses.csv"
    path.write_text("\n".join(lines) + "\n")
    assert mistakes_in(robot, read_poses([read_run(path)], robot.profile)) == ()


def test_the_sentence_says_where_what_and_what_to_do(tmp_path: Path) -> None:
    table = recorded(SCENE)
    run, path = written(tmp_path, replace(table, motor=-table.motor, oriented=False).csv())
    profile = read_robot(path)
    measured: MeasuredPoses = read_poses([read_run(run)], profile)
    with pytest.raises(RunError) as told:
        refuse_mistakes(robot_of(profile), measured)
    text = str(told.value)
    assert text.startswith(f"{run}: motor-sign:all: all motor angles have the other sign: ")
    assert "mm as they are" in text
    assert "gearbox.direction" in text


@pytest.mark.slow
def test_the_benchmark_judges_what_it_draws() -> None:
    """A small run of benchmarks/robot_mistakes.py, through the command."""
    told = robot_mistakes.summary(robot_mistakes.run(2, 1, 8))
    assert (told["named"], told["false_alarms"], told["internal_errors"]) == (2, 0, 0)


def test_the_judge_compares_the_motor_angles_and_not_the_words() -> None:
    swap, sign = mistake_of("swap", 3, LINES), mistake_of("sign", 3, LINES)
    (columns,), (line,) = swap.codes, sign.codes
    first, second = columns.partition(":")[2].split("-")
    same = {first: second, second: first}
    name = line.partition(":")[2]
    other = f"motor-sign:{same.get(name, name)}"
    made = [swap, sign]
    assert robot_mistakes.is_named(made, [[[line, columns]]], LINES)
    assert robot_mistakes.is_named(made, [[[columns, other]]], LINES)
    assert not robot_mistakes.is_named(made, [[[columns]]], LINES)
    assert not robot_mistakes.is_named(made, [[["poses-unlike"]]], LINES)
