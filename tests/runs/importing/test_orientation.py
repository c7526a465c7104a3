"""Rotation vectors, fixed angles and orders of a quaternion: decided by the values, or asked."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from winchkit.arrays import Array
from winchkit.model.rotation import rotation_from_quaternion, rotation_of
from winchkit.runs.importing.answers import Answers
from winchkit.runs.importing.assignment import Guess
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.mapping import guess_by, mapping_of
from winchkit.runs.importing.streams import streams_of

TIME = np.arange(300) / 50
SWING = np.stack([np.sin(TIME), np.cos(0.7 * TIME), np.sin(0.4 * TIME + 1)], axis=1)


def guessed(path: Path, names: str, values: Array, **told: str) -> Guess:
    table = np.column_stack([TIME, np.sin(TIME), np.cos(TIME), TIME, values])
    head = "time [s],x [m],y [m],z [m]," + names
    np.savetxt(path, table, "%.9f", ",", header=head, comments="")
    return guess_columns(read_table(path), Answers(**told))  # type: ignore[arg-type]


def turned(guess: Guess) -> Array:
    (stream,) = streams_of(guess).streams
    found = stream.channels
    if "platform_qw" in found:
        parts = [found[f"platform_q{axis}"] for axis in "wxyz"]
        return rotation_from_quaternion(np.stack(parts, axis=1))
    return rotation_of(*(found[f"platform_{name}"] for name in ("roll", "pitch", "yaw")))


def rotations(kind: str, size: float) -> tuple[Array, Array]:
    """Components and matrices, by scipy."""
    values = SWING * size
    if kind == "vector":
        return values, Rotation.from_rotvec(values).as_matrix()
    return values, Rotation.from_euler("xyz", values).as_matrix()


@pytest.mark.parametrize("kind", ["vector", "angles"])
@pytest.mark.parametrize(
    "names", ["rx [rad],ry [rad],rz [rad]", "Rot X (rad),Rot Y (rad),Rot Z (rad)"]
)
def test_components_that_may_be_either_are_asked(kind: str, names: str, tmp_path: Path) -> None:
    values, true = rotations(kind, 0.5)
    (question,) = guessed(tmp_path / "a.csv", names, values).questions
    kinds = ("angles", "vector", "xyz")
    assert question.options == tuple(f"--orientation {kind}" for kind in kinds)
    guess = guessed(tmp_path / "a.csv", names, values, orientation=kind)
    assert not guess.questions
    assert turned(guess) == pytest.approx(true, abs=1e-7)


def test_a_pitch_beyond_a_right_angle_is_of_a_rotation_vector(tmp_path: Path) -> None:
    values, true = rotations("vector", 1.8)
    guess = guessed(tmp_path / "a.csv", "rx [rad],ry [rad],rz [rad]", values)
    assert turned(guess) == pytest.approx(true, abs=1e-7)
    assert any("rotation vector" in note for note in guess.notes)
    mapped = guess_by(read_table(tmp_path / "a.csv"), mapping_of("m", [("a", guess)]))
    assert turned(mapped) == pytest.approx(true, abs=1e-7)


def test_the_continuous_convention_is_taken(tmp_path: Path) -> None:
    """A vector at π turns its sign; fixed angles jump at another place."""
    turn = np.stack([0.3 * np.ones(300), 0.4 * np.sin(TIME), 3 + 0.3 * np.sin(TIME)], axis=1)
    own = Rotation.from_euler("xyz", turn)
    for kind, values in (("vector", own.as_rotvec()), ("angles", own.as_euler("xyz"))):
        guess = guessed(tmp_path / f"{kind}.csv", "rx [rad],ry [rad],rz [rad]", values)
        assert not guess.questions
        assert turned(guess) == pytest.approx(own.as_matrix(), abs=1e-7)


@pytest.mark.parametrize(
    ("names", "size"),
    [("roll [rad],pitch [rad],yaw [rad]", 0.5), ("rx [rad],ry [rad],rz [rad]", 0.01)],
)
def test_clear_names_and_small_angles_are_not_asked(
    names: str, size: float, tmp_path: Path
) -> None:
    values, true = rotations("angles", size)
    assert turned(guessed(tmp_path / "a.csv", names, values)) == pytest.approx(true, abs=1e-7)


@pytest.mark.parametrize("order", ["wxyz", "xyzw"])
@pytest.mark.parametrize(("size", "is_asked"), [(0.5, False), (1.8, True)])
def test_the_order_of_a_numbered_quaternion(
    order: str, size: float, is_asked: bool, tmp_path: Path
) -> None:
    own = Rotation.from_rotvec(SWING * size)
    values = own.as_quat(scalar_first=order == "wxyz")
    told = {}
    if is_asked:
        (question,) = guessed(tmp_path / "a.csv", "q0,q1,q2,q3", values).questions
        assert question.options == ("--orientation wxyz", "--orientation xyzw")
        told = {"orientation": order}
    guess = guessed(tmp_path / "a.csv", "q0,q1,q2,q3", values, **told)
    assert not guess.questions
    assert turned(guess) == pytest.approx(own.as_matrix(), abs=1e-6)
