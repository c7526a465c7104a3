"""Tables in long form: one row for each axis at each instant."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from winchkit.arrays import Array
from winchkit.errors import RunError
from winchkit.runs.importing.answers import Answers, read_column
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.long_table import axes_of, likely_axis
from winchkit.runs.importing.mapping import guess_by, mapping_of
from winchkit.runs.importing.runs import run_of
from winchkit.runs.importing.streams import streams_of
from winchkit.runs.importing.table import Table

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
    assert question.options == ('--axis "axis"', '--axis ""')
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


def table_of(rows: list[str], head: str) -> Table:
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
