"""Files whose structure is changed at random: no traceback, no wrong number without a word.

``benchmarks/import_files.py`` does the same with as many files as it is given; the kinds of files
that it found are tests of their own: each was a wrong number or a lost header.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from fuzzing.imported import outcome_of
from fuzzing.recordings import recording
from winchkit.arrays import Array
from winchkit.runs.importing.answers import Answers
from winchkit.runs.importing.assignment import Guess
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.runs import run_of
from winchkit.runs.importing.streams import streams_of
from winchkit.runs.run import Run

FILES = 20
TIME = np.arange(400) * 0.01


def angle(time: Array) -> Array:
    """Some turns to and fro, degrees."""
    return np.asarray(900 * np.sin(1.3 * time))


def written(path: Path, head: str, *columns: list[str], ending: str = "\n") -> Path:
    rows = [",".join(cells) for cells in zip(*columns, strict=True)]
    path.write_text("\n".join([head, *rows]) + ending)
    return path


def texts(values: Array, form: str) -> list[str]:
    return [f"{value:{form}}" for value in values]


def run_from(guess: Guess) -> Run:
    return run_of(streams_of(guess), {})


@pytest.mark.parametrize("block", range(3))
def test_a_mutated_file_comes_in_right_or_with_a_word(tmp_path: Path, block: int) -> None:
    kinds: Counter[str] = Counter()
    for seed in range(block * FILES, (block + 1) * FILES):
        made = recording(seed, tmp_path)
        found = outcome_of(made, tmp_path / f"runs{seed}")
        assert not found.is_fault, (seed, found.kind, found.text, made.changes)
        kinds[found.kind] += 1
    # Most changes are those of usual files, which a reader must take.
    assert kinds["right"] > FILES / 2, kinds


def test_stamps_with_a_blank_between_tabs_are_one_cell(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    rows = [
        f"2025-03-04 11:59:{5 + t:09.6f}\t{a:.4f}\t{a / 1000:.4f}"
        for t, a in zip(TIME, angle(TIME), strict=True)
    ]
    path.write_text("\n".join(["Time\tPosition [deg]\tTorque [Nm]", *rows]) + "\n")
    guess = guess_columns(read_table(path))
    assert [item.source for item in guess.used] == ["Time", "Position", "Torque"]
    assert np.degrees(run_from(guess)["motor_angle"]) == pytest.approx(angle(TIME), abs=1e-3)


@pytest.mark.parametrize(
    ("form", "kept", "said"),
    [(".4f", 399, "The row is left out"), (".0f", 400, "may lack digits"), ("g", 400, "may lack")],
)
def test_a_last_number_without_a_line_end_may_be_cut_off(
    tmp_path: Path, form: str, kept: int, said: str
) -> None:
    cells = texts(angle(TIME) + 2000, form)
    cells[-1] = cells[-1][:-2]
    head = "Time [s],Position [deg]"
    path = written(tmp_path / "log.csv", head, texts(TIME, ".3f"), cells, ending="")
    guess = guess_columns(read_table(path))
    assert any(said in note for note in guess.table.notes)
    assert len(run_from(guess)) == kept


@pytest.mark.parametrize("to", [60, 300])
def test_a_row_moved_elsewhere_does_not_hide_that_an_angle_wraps(tmp_path: Path, to: int) -> None:
    order = list(range(len(TIME)))
    order.insert(to, order.pop(200))
    time, wrapped = TIME[order], np.mod(angle(TIME), 360)[order]
    head = "Time [s],Position [deg]"
    path = written(tmp_path / "log.csv", head, texts(time, ".3f"), texts(wrapped, ".4f"))
    run = run_from(guess_columns(read_table(path)))
    assert any("out of order" in note for note in run.notes)
    assert np.degrees(run["motor_angle"]) == pytest.approx(angle(run.time), abs=1e-3)


def test_an_angle_that_wraps_too_fast_for_its_samples_is_asked(tmp_path: Path) -> None:
    fast = np.mod(20_000 * np.sin(1.3 * TIME), 360)
    head = "Time [s],Position [deg]"
    path = written(tmp_path / "log.csv", head, texts(TIME, ".3f"), texts(fast, ".4f"))
    (question,) = guess_columns(read_table(path)).questions
    assert question.options == ('--modulo "Position=360"', '--modulo "Position=0"')


@pytest.mark.parametrize("decimals", [0, 3, 4, 6])
@pytest.mark.parametrize("size", [9000, 32000])
def test_a_lost_sign_is_asked_whatever_the_decimals_and_the_size_of_the_numbers(
    tmp_path: Path, decimals: int, size: int
) -> None:
    whole = np.round(size * np.sin(2 * TIME))
    stored = np.mod(whole, 65536) / 10**decimals
    head = "Time [s],Position [rad],Torque [Nm]"
    cells = texts(TIME, ".3f"), texts(TIME, ".2f"), texts(stored, f".{decimals}f")
    table = read_table(written(tmp_path / "log.csv", head, *cells))
    (question,) = guess_columns(table).questions
    assert question.options[0] == '--signed "Torque"'
    run = run_from(guess_columns(table, Answers(signed=("Torque",))))
    expected = whole / 10**decimals
    assert run["motor_torque"] == pytest.approx(expected, abs=10.0**-decimals / 2)
