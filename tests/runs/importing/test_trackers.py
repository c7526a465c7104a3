"""Exports of trackers give the same poses, whatever the representation of the orientation."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tracker_exports import (
    aruco,
    leica,
    matrix,
    numbered_quaternion,
    optitrack,
    optitrack_body,
    poses,
    spatial_analyzer,
    vicon,
    vicon_helical,
    vicon_objects,
)
from winchkit.arrays import Array
from winchkit.errors import RunError
from winchkit.model.rotation import rotation_from_quaternion, rotation_of
from winchkit.runs.importing.answers import Answers, read_column
from winchkit.runs.importing.assignment import Guess
from winchkit.runs.importing.clocks.joint import joined
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.runs import run_of
from winchkit.runs.importing.session import guesses_of
from winchkit.runs.importing.streams import Streams, streams_of


def guessed(path: Path, write: Callable[[Path], None], answers: Answers | None = None) -> Guess:
    write(path)
    return guess_columns(read_table(path), answers)


def channels(guess: Guess) -> dict[str, Array]:
    (stream,) = streams_of(guess).streams
    return stream.channels


@pytest.mark.parametrize(
    "write",
    [
        *(optitrack, optitrack_body, vicon, vicon_objects, vicon_helical, aruco),
        *(spatial_analyzer, leica, matrix, numbered_quaternion),
    ],
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


@pytest.mark.parametrize("kind", ["angles", "vector", "xyz"])
def test_angles_of_motion_capture_are_asked_by_their_convention(kind: str, tmp_path: Path) -> None:
    """Large rotations about all axes, whose conventions differ by degrees."""
    time = np.arange(50) / 100
    angles = np.stack([0.3 * np.sin(time), 0.2 + 0 * time, 0.4 * np.cos(time)], axis=1)
    turned = {
        "angles": Rotation.from_euler("xyz", angles),
        "vector": Rotation.from_rotvec(angles),
        "xyz": Rotation.from_euler("XYZ", angles),
    }
    head = "Segments\n100\n,,plat:plat,,,,,\nFrame,Sub Frame,RX,RY,RZ,TX,TY,TZ\n"
    head += ",,deg,deg,deg,mm,mm,mm\n"
    rows = [
        f"{k + 1},0,{','.join(map(repr, own))},1,2,3"
        for k, own in enumerate(np.degrees(angles).tolist())
    ]
    path = tmp_path / "segments.csv"
    path.write_text(head + "\n".join(rows) + "\n")
    (question,) = guess_columns(read_table(path)).questions
    assert f"--orientation {kind}" in question.options
    found = channels(guess_columns(read_table(path), Answers(orientation=kind)))
    if kind == "angles":
        names = ("platform_roll", "platform_pitch", "platform_yaw")
        assert np.stack([found[n] for n in names], axis=1) == pytest.approx(angles, abs=1e-9)
        return
    quaternion = np.stack([found[f"platform_q{axis}"] for axis in "wxyz"], axis=1)
    assert rotation_from_quaternion(quaternion) == pytest.approx(turned[kind].as_matrix(), abs=1e-9)


def test_of_several_markers_the_user_names_one(tmp_path: Path) -> None:
    rows = [f"{k},{m},{m + k},2,3,0,0,0.1" for k in range(30) for m in (3, 7)]
    path = tmp_path / "markers.csv"
    names = "time [s],marker_id,x [m],y [m],z [m],rvec_x,rvec_y,rvec_z"
    path.write_text("\n".join([names, *rows]) + "\n")
    (question,) = guess_columns(read_table(path)).questions
    assert question.options == ('--body "3"', '--body "7"')
    found = channels(guess_columns(read_table(path), Answers(body="7")))
    assert found["platform_x"] == pytest.approx(7 + np.arange(30.0))


def test_a_column_of_one_of_several_markers_is_given_beside_another_file(tmp_path: Path) -> None:
    motors, markers = tmp_path / "motors.csv", tmp_path / "markers.csv"
    head = "Point;1.motor_angle [rad];2.motor_angle [rad]\n"
    motors.write_text(head + "".join(f"P{k};{k};{-k}\n" for k in range(30)))
    rows = [f"P{k},{m},{m + k},2,3" for k in reversed(range(30)) for m in (3, 7)]
    markers.write_text("\n".join(["image,marker_id,tvec_x,tvec_y,tvec_z", *rows]) + "\n")
    tables = [read_table(motors), read_table(markers)]
    (question,) = guesses_of(tables, Answers())[1].questions
    assert question.options == ('--body "3"', '--body "7"')
    chosen = Answers(body="7", columns=(read_column("platform_x=7 tvec_x [m]"),))
    whole, (joint,) = joined([streams_of(guess) for guess in guesses_of(tables, chosen)])
    assert joint.method == "names"
    assert run_of(whole, {})["platform_x"] == pytest.approx(7 + np.arange(30.0))


POINTS = "P003;1300;2;3\nP001;1100;2;3\nCENTRE;0;0;0\nP002;1200;2;3\n"
"""Of a tracker, in another order, and one that the controller does not have."""


def points(folder: Path, text: str, head: str = "") -> tuple[Streams, Streams]:
    """Motor angles of four points, and a tracker's table."""
    motors, tracker = folder / "motors.csv", folder / "tracker.txt"
    motors.write_text(
        "Point;m1_pos [rad];m2_pos [rad]\n" + "".join(f"P{k:03};{k};-{k}\n" for k in range(5))
    )
    tracker.write_text(head + text)
    answers = Answers(columns=(read_column("platform_x=X [mm]"),))
    return streams_of(guess_columns(read_table(motors))), streams_of(
        guess_columns(read_table(tracker), answers)
    )


@pytest.mark.parametrize(
    ("head", "change"),
    [
        ("", lambda t: t),
        ("Name;X;Y;Z\n", lambda t: t),
        (
            "// SpatialAnalyzer 2021\n// Working Frame: A::WORLD\n",
            lambda t: "".join(f"A,Poses,{row},0,12.7\n" for row in t.replace(";", ",").split()),
        ),
        ("", lambda t: "".join(f"A Poses {row}\n" for row in t.replace(";", " ").split("\n")[:-1])),
    ],
)
def test_points_are_joined_by_their_names(
    head: str, change: Callable[[str], str], tmp_path: Path
) -> None:
    whole, (joint,) = joined([*points(tmp_path, change(POINTS), head)])
    run = run_of(whole, {})
    assert joint.method == "names"
    assert run["1.motor_angle"].tolist() == [1, 2, 3]
    assert run["platform_x"] == pytest.approx([1.1, 1.2, 1.3])
    assert "P000, P004 of" in joint.text
    assert "CENTRE of" in joint.text


@pytest.mark.parametrize("spelled", [lambda t: t.replace("P00", "P"), str.lower])
def test_points_may_be_spelled_otherwise(spelled: Callable[[str], str], tmp_path: Path) -> None:
    whole, (joint,) = joined([*points(tmp_path, spelled(POINTS), "Name;X;Y;Z\n")])
    assert joint.method == "names"
    assert run_of(whole, {})["platform_x"] == pytest.approx([1.1, 1.2, 1.3])


def test_a_point_that_stands_twice_is_not_joined(tmp_path: Path) -> None:
    with pytest.raises(RunError, match=r"tracker.txt:2: the point 'P001' stands in 2 rows"):
        joined(
            [
                *points(
                    tmp_path,
                    POINTS + "P001;1100.2;2;3\n" + "".join(f"Q{k};1;2;3\n" for k in range(9)),
                )
            ]
        )


def test_lists_of_different_points_are_not_joined_by_name(tmp_path: Path) -> None:
    with pytest.raises(RunError, match="not as many rows"):
        joined([*points(tmp_path, POINTS.replace("P", "Q"))])


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


def test_rows_that_a_tracker_did_not_see_are_left_out(tmp_path: Path) -> None:
    path, motors = tmp_path / "poses.csv", tmp_path / "motors.csv"
    optitrack_body(path)
    lines = path.read_text().splitlines()
    for unseen in (4, 31):
        frame, time, *cells = lines[7 + unseen].split(",")
        lines[7 + unseen] = ",".join([frame, time, *[""] * len(cells)])
    path.write_text("\n".join(lines) + "\n")
    count = len(poses()[0])
    motors.write_text("1.motor_angle [rad]\n" + "".join(f"{k}\n" for k in range(count)))
    parts = [streams_of(guess_columns(read_table(one))) for one in (motors, path)]
    kept = np.delete(np.arange(count), (4, 31))
    for pair in (parts, parts[::-1]):
        whole, (joint,) = joined(pair)
        run = run_of(whole, {})
        assert joint.text.startswith("joined row by row (58 rows); line 12, 39 of")
        assert run["1.motor_angle"] == pytest.approx(kept)
        assert run["platform_x"] == pytest.approx(poses()[1][kept, 0], abs=1e-8)


def _captured(kind: str) -> str:
    """Text of an export of three markers, or of one body, by the poses of the other exports."""
    time, position, yaw, _ = poses()
    count, millimetres = len(time), 1e3 * position
    c, s, zero = np.cos(yaw), np.sin(yaw), np.zeros(count)
    if kind == "body":
        keys, names = "NO_OF_BODIES\t1", "BODY_NAMES\tplatform"
        # Rx Ry Rz with a turn about z alone; the matrix by columns.
        entries = (c, s, zero, -s, c, zero, zero, zero, zero + 1)
        columns = [*millimetres.T, zero, zero, np.degrees(yaw), zero, *entries]
    else:
        keys, names = "NO_OF_MARKERS\t3", "MARKER_NAMES\tleft\tright\ttop"
        columns = [*(millimetres - 40).T, *(millimetres + 40).T, *millimetres.T]
    rows = [[f"{value:.12g}" for value in row] for row in zip(*columns, strict=True)]
    if kind == "TRC":
        head = (
            "PathFileType\t4\t(X/Y/Z)\tm.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n"
            f"100\t100\t{count}\t3\tmm\nFrame#\tTime\tleft\t\t\tright\t\t\ttop\t\t\n"
            "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\tX3\tY3\tZ3\n\n"
        )
        rows = [
            [str(k + 1), f"{t:.12g}", *row]
            for k, (t, row) in enumerate(zip(time, rows, strict=True))
        ]
    else:
        head = f"NO_OF_FRAMES\t{count}\nFREQUENCY\t100\n{keys}\nTIME_STAMP\t2026-01-02\n{names}\n"
    return head + "\n".join("\t".join(row) for row in rows) + "\n"


def test_a_body_of_qualisys_is_a_pose(tmp_path: Path) -> None:
    path = tmp_path / "body.tsv"
    path.write_text(_captured("body"))
    guess = guess_columns(read_table(path))
    assert not guess.questions
    found = channels(guess)
    _, position, yaw, _ = poses()
    assert found["platform_x"] == pytest.approx(position[:, 0], abs=1e-8)
    names = ("platform_qw", "platform_qx", "platform_qy", "platform_qz")
    turned = rotation_from_quaternion(np.stack([found[name] for name in names], axis=1))
    zero = np.zeros(len(yaw))
    assert turned == pytest.approx(rotation_of(zero, zero, yaw), abs=1e-8)


@pytest.mark.parametrize("kind", ["markers", "TRC"])
def test_markers_are_points_of_which_one_is_chosen(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "markers.tsv"
    path.write_text(_captured(kind))
    guess = guess_columns(read_table(path))
    (question,) = guess.questions
    assert question.options == ('--body "left"', '--body "right"', '--body "top"')
    assert any("rigid body (6D)" in note for note in guess.notes + guess.table.notes)
    chosen = guess_columns(read_table(path), Answers(body="top"))
    found = channels(chosen)
    assert set(found) == {"platform_x", "platform_y", "platform_z"}
    assert found["platform_z"] == pytest.approx(poses()[1][:, 2], abs=1e-8)


def test_positions_that_were_not_tracked_are_missing(tmp_path: Path) -> None:
    path = tmp_path / "markers.tsv"
    lines = _captured("markers").splitlines()
    lines[20] = "\t".join(["0.000"] * 9)
    path.write_text("\n".join(lines) + "\n")
    table = read_table(path)
    assert np.flatnonzero(np.isnan(table.columns[0].values)).tolist() == [15]


def test_a_c3d_file_is_named(tmp_path: Path) -> None:
    path = tmp_path / "markers.c3d"
    path.write_bytes(b"\x02P" + bytes(1022))
    with pytest.raises(RunError, match="C3D"):
        read_table(path)


def test_the_unit_of_one_axis_of_a_pose_holds_for_the_others(tmp_path: Path) -> None:
    """An export that does not declare its unit of length; it is asked once, and given once."""
    path = tmp_path / "poses.csv"
    optitrack(path)
    lines = path.read_text().replace("Millimeters", "").replace("Meters", "")
    path.write_text(lines)
    (question,) = guess_columns(read_table(path)).questions
    (option,) = question.options
    answer = read_column(option.removeprefix('--column "').rstrip('"').replace("UNIT", "m"))
    guess = guess_columns(read_table(path), Answers(columns=(answer,)))
    assert not guess.questions
    used = {item.channel: item.factor for item in guess.used}
    assert [used[f"platform_{axis}"] for axis in "xyz"] == [1.0, 1.0, 1.0]
    assert {"platform_qw", "platform_qx", "platform_qy", "platform_qz"} <= set(used)
