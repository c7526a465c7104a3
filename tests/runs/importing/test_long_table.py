"""Tables in long form: one row for each axis at each instant."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from winchkit.arrays import Array
from winchkit.cli import main
from winchkit.errors import RunError
from winchkit.runs import read_run
from winchkit.runs.importing.answers import Answers, read_column
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.long_table import axes_of, likely_axis
from winchkit.runs.importing.mapping import guess_by, mapping_of
from winchkit.runs.importing.runs import run_of
from winchkit.runs.importing.streams import streams_of
from winchkit.runs.importing.table import ColumnTable

TIME = np.arange(120) * 0.02


def angle(axis: int, time: Array) -> Array:
    return 3.0 * (axis + 1) + np.sin((axis + 1) * time)


def long_rows(names: tuple[str, ...]) -> list[str]:
    """Time, name, angle and torque; the axes in turn."""
    return [
        f"{time:.6f},{name},{angle(axis, time):.9f},{0.1 * axis + 0.01 * time:.9f}"
        for time in TIME
        for axis, name in enumerate(names)
    ]


def written(path: Path, rows: list[str], head: str) -> Path:
    path.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    return path


HEAD = "time [s],axis,position [rad],torque [N m]"


@pytest.mark.parametrize("names", [("1", "2", "5"), ("left", "right", "boom")])
def test_the_column_of_the_axis_is_asked_for_and_separates_the_rows(
    tmp_path: Path, names: tuple[str, ...]
) -> None:
    table = read_table(written(tmp_path / "a.csv", long_rows(names), HEAD))
    (question,) = guess_columns(table).questions
    assert question.options == ('--axis "axis"', '--kind "axis"', '--axis ""')
    assert f"names ({', '.join(names)})" in question.text
    found = guess_columns(table, Answers(axis="axis"))
    assert found.questions == ()
    run = run_of(streams_of(found), {})
    assert len(run) == len(TIME)
    for number, name in enumerate(names):
        assert run[f"{name}.motor_angle"] == pytest.approx(angle(number, run.time))
        assert run[f"{name}.motor_torque"] == pytest.approx(0.1 * number + 0.01 * run.time)


def test_axes_that_are_sampled_one_after_the_other_keep_their_times(tmp_path: Path) -> None:
    """The angle of the first axis is its time: the others are at these times, not at their own."""
    rows = [
        f"{stamp:.6f},{name},{stamp if axis == 0 else angle(axis, stamp):.9f},0.1"
        for time in TIME
        for axis, name in enumerate(("1", "2", "5"))
        for stamp in [time + 0.005 * axis]
    ]
    table = read_table(written(tmp_path / "a.csv", rows, HEAD))
    run = run_of(streams_of(guess_columns(table, Answers(axis="axis"))), {})
    time = run["1.motor_angle"]
    assert np.diff(time) == pytest.approx(np.diff(run.time))
    for axis, name in ((1, "2"), (2, "5")):
        known = np.isfinite(run[f"{name}.motor_angle"])
        assert known.sum() >= len(TIME) - 2
        bent = 0.02**2 / 8 * (axis + 1) ** 2
        expected = angle(axis, time[known])
        assert run[f"{name}.motor_angle"][known] == pytest.approx(expected, abs=1.1 * bent)


def test_a_mapping_keeps_the_axis(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", long_rows(("1", "2", "5")), HEAD)
    found = guess_columns(read_table(path), Answers(axis="axis"))
    mapping = mapping_of("m", [("a", found)])
    assert mapping.log[0].axis == "axis"
    again = guess_by(read_table(path), mapping)
    first, second = (run_of(streams_of(guess), {}) for guess in (found, again))
    assert list(first.channels) == list(second.channels)
    other = written(tmp_path / "b.csv", ["0,1", "1,2"], "time [s],position [rad]")
    with pytest.raises(RunError, match=r"lacks the columns 'torque', 'axis'"):
        guess_by(read_table(other), mapping)


@settings(max_examples=30)
@given(st.integers(2, 6), st.booleans(), st.integers(0, 2**32 - 1))
def test_a_flag_that_toggles_names_no_axis(values: int, by_turns: bool, seed: int) -> None:
    """One axis beside a counter modulo n, or a flag at random: rows of one signal."""
    rng = np.random.default_rng(seed)
    time = np.arange(300) / 100
    signal = np.sin(3 * time) + 1e-3 * rng.standard_normal(300)
    flag = np.arange(300) % values if by_turns else rng.integers(0, values, 300)
    rows = [f"{t:.3f},{f},{s:.6f}" for t, f, s in zip(time, flag, signal, strict=True)]
    table = table_of(rows, "time [s],state,position [rad]")
    assert likely_axis(table) is None


def table_of(rows: list[str], head: str) -> ColumnTable:
    with tempfile.TemporaryDirectory() as folder:
        return read_table(written(Path(folder) / "a.csv", rows, head))


@pytest.mark.parametrize(
    ("by", "said"),
    [("bxis", "there is no column 'bxis' that names the axis"), ("time", "has 0 values")],
)
def test_a_column_that_names_no_axis_is_refused(tmp_path: Path, by: str, said: str) -> None:
    table = read_table(written(tmp_path / "a.csv", long_rows(("1", "2")), HEAD))
    with pytest.raises(RunError, match=said):
        axes_of(table, by)


def test_an_empty_answer_leaves_the_rows_as_they_are(tmp_path: Path) -> None:
    table = read_table(written(tmp_path / "a.csv", long_rows(("1", "2")), HEAD))
    found = guess_columns(table, Answers(axis="", columns=(read_column("motor_torque="),)))
    assert found.axis == ""
    assert found.questions == ()


def kinds_file(path: Path) -> Path:
    """Rows of two kinds: an angle and its velocity in one, a torque 2 ms later in the other."""
    time = np.arange(0.0, 12.0, 0.02)
    rows = [
        f"{t:.4f},1,{np.sin(t):.9f},{np.cos(t):.9f}\n{t + 0.002:.4f},2,{0.2 * (t + 0.002):.9f},"
        for t in time
    ]
    path.write_text("\n".join(["time [s],id,v1,v2", *rows]) + "\n")
    return path


def test_rows_of_two_kinds_are_asked_for_and_have_columns_of_their_own(tmp_path: Path) -> None:
    path = kinds_file(tmp_path / "log.csv")
    table = read_table(path)
    (question,) = guess_columns(table).questions
    assert question.options == ('--kind "id"', '--axis "id"', '--axis ""')
    columns = ("motor_angle=1 v1 [rad]", "motor_velocity=v2 [rad/s]", "motor_torque=2 v1 [N m]")
    answers = Answers(kind="id", columns=tuple(map(read_column, columns)))
    found = guess_columns(table, answers)
    assert not found.questions
    run = run_of(streams_of(found), {})
    # The torque is the clock: without the 2 ms between the kinds the angle would be 2e-3 rad off.
    assert run["motor_angle"] == pytest.approx(np.sin(run["motor_torque"] / 0.2), abs=1e-4)
    mapped = run_of(streams_of(guess_by(read_table(path), mapping_of("m", [("log", found)]))), {})
    assert np.array_equal(mapped["motor_torque"], run["motor_torque"])


def test_the_axes_of_one_file_are_joined_to_columns_of_another(tmp_path: Path) -> None:
    """The second file has no column of the axis, and spells the winches in small letters."""
    call, time = CliRunner(), np.arange(0.0, 20.0, 0.01)
    first, second = tmp_path / "drives.csv", tmp_path / "cells.csv"
    rows = [
        f"{t:.4f},{name},{np.sin(0.7 * t + n) * 30:.6f},{np.cos(0.7 * t + n):.6f}"
        for t in time
        for n, name in enumerate("AB")
    ]
    first.write_text("\n".join(["time [s],axis,position [rad],torque [N m]", *rows]) + "\n")
    force = [f"{t:.4f},{50 * np.cos(0.7 * t):.5f},{50 * np.cos(0.7 * t + 1):.5f}" for t in time]
    second.write_text("\n".join(["time [s],a tension [N],b tension [N]", *force]) + "\n")
    paths = [str(first), str(second), "-o", str(tmp_path / "runs"), "--axis", "axis", "--join"]
    assert call.invoke(main, ["import", *paths, "--lag", "0 s", "-y"]).exit_code == 0
    run = read_run(tmp_path / "runs" / "drives.csv")
    for name in "AB":
        assert run[f"{name}.tension"] == pytest.approx(50 * run[f"{name}.motor_torque"], abs=0.02)
