"""Exports of trackers give the same poses, whatever the representation of the orientation."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tracker_exports import (
    leica,
    matrix,
    numbered_quaternion,
    optitrack,
    poses,
    spatial_analyzer,
    vicon,
)
from winchkit.arrays import Array
from winchkit.model.robot.rotation import rotation_from_quaternion, rotation_of
from winchkit.runs.importing.answers import Answers
from winchkit.runs.importing.assignment import Guess
from winchkit.runs.importing.clocks import joined
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.runs import run_of
from winchkit.runs.importing.streams import streams_of


def guessed(path: Path, write: Callable[[Path], None], answers: Answers | None = None) -> Guess:
    write(path)
    return guess_columns(read_table(path), answers)


def channels(guess: Guess) -> dict[str, Array]:
    (stream,) = streams_of(guess).streams
    return stream.channels


@pytest.mark.parametrize(
    "write", [optitrack, vicon, spatial_analyzer, leica, matrix, numbered_quaternion]
)
def test_every_export_gives_the_same_poses(write: Callable[[Path], None], tmp_path: Path) -> None:
    guess = guessed(tmp_path / "poses.csv", write)
    assert not guess.questions
    found = channels(guess)
    _, position, yaw, _ = poses()
    for axis, name in enumerate(("platform_x", "platform_y", "platform_z")):
        assert found[name] == pytest.approx(position[:, axis], abs=1e-8)
    if write is vicon:
        assert set(found) == {"platform_x", "platform_y", "platform_z"}
        return
    if "platform_yaw" in found:
        turned = rotation_of(*(found[f"platform_{name}"] for name in ("roll", "pitch", "yaw")))
    else:
        names = ("platform_qw", "platform_qx", "platform_qy", "platform_qz")
        turned = rotation_from_quaternion(np.stack([found[name] for name in names], axis=1))
    zero = np.zeros(len(yaw))
    assert turned == pytest.approx(rotation_of(zero, zero, yaw), abs=1e-8)


def test_of_several_bodies_the_user_names_one(tmp_path: Path) -> None:
    both = lambda path: optitrack(path, ("Platform", "Gripper"))  # noqa: E731
    guess = guessed(tmp_path / "poses.csv", both)
    (question,) = guess.questions
    assert question.options == ('--body "Platform"', '--body "Gripper"')
    one = guessed(tmp_path / "poses.csv", both, Answers(body="gripper"))
    assert not one.questions
    assert {a.source.split()[2] for a in one.used if "platform_x" in a.channel} == {"Gripper"}
    assert guessed(tmp_path / "poses.csv", both, Answers(body="hand")).questions


def test_a_file_without_times_has_the_declared_rate(tmp_path: Path) -> None:
    guess = guessed(tmp_path / "poses.csv", vicon)
    assert guess.sample_rate == pytest.approx(100.0)
    (stream,) = streams_of(guess).streams
    assert stream.time[-1] == pytest.approx(poses()[0][-1])


def test_poses_are_joined_row_by_row_with_the_motor_angles(tmp_path: Path) -> None:
    guess = guessed(tmp_path / "poses.csv", leica)
    lines = ["pose,m1_pos [deg],m2_pos [deg],m1_force [N],m2_force [N]"]
    lines += [f"{k},{10 * k},{-3 * k},{100 + k},{200 + k}" for k in range(len(poses()[0]))]
    motors = tmp_path / "motors.csv"
    motors.write_text("\n".join(lines) + "\n")
    angles = guess_columns(read_table(motors))
    assert not angles.questions
    whole, (joint,) = joined([streams_of(angles), streams_of(guess)])
    run = run_of(whole, {})
    assert joint.method == "rows"
    assert run.winches() == ["1", "2"]
    assert run["2.motor_angle"][5] == pytest.approx(np.radians(-15))
    assert run["1.tension"][5] == 105
    assert run["platform_y"] == pytest.approx(poses()[1][:, 1], abs=1e-8)
