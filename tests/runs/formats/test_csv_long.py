"""CSV files of many rows: read a block at a time, faults still at their lines."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from winchkit.errors import RunError
from winchkit.runs.formats.csv_read import read_csv

ROWS = 30_000
HEADER = "time [s],motor_angle [rad],tension [N],load [N],remark"


def lines() -> list[str]:
    return [f"{0.001 * n:.3f},{0.25 * n},{1e-3 * n},{n % 7}.5,{n}" for n in range(ROWS)]


def saved(path: Path, rows: list[str]) -> Path:
    path.write_text("\n".join(["# load_mass: 3 kg", HEADER, *rows]) + "\n", encoding="utf-8")
    return path


def test_every_row_is_there_in_its_order(tmp_path: Path) -> None:
    run = read_csv(saved(tmp_path / "long.csv", lines()))
    number = np.arange(ROWS)
    np.testing.assert_array_equal(run["motor_angle"], 0.25 * number)
    np.testing.assert_array_equal(run["load"], number % 7 + 0.5)
    np.testing.assert_array_equal(run["remark"], number)


def test_a_wrong_cell_far_down_is_reported_with_its_line(tmp_path: Path) -> None:
    rows = lines()
    rows[4095] = "4.095,x,1,1,1"
    rows[12_345] = "12.345,1,y,1,1"
    with pytest.raises(RunError) as told:
        read_csv(saved(tmp_path / "wrong.csv", rows))
    assert [fault.line for fault in told.value.faults] == [4095 + 3, 12_345 + 3]


def test_text_far_down_makes_an_unknown_column_text(tmp_path: Path) -> None:
    rows = lines()
    rows[20_000] = "20.000,1,1,1,begun anew"
    run = read_csv(saved(tmp_path / "text.csv", rows))
    assert "remark" not in run
    assert any("'remark' contains text" in note for note in run.notes)


def test_a_file_cut_off_far_down_is_reported_so(tmp_path: Path) -> None:
    with pytest.raises(RunError) as told:
        read_csv(saved(tmp_path / "cut.csv", [*lines(), "30.0,1"]))
    (fault,) = told.value.faults
    assert fault.line == ROWS + 3
    assert "is the file cut off?" in fault.message


def test_reading_holds_little_more_than_the_numbers(tmp_path: Path) -> None:
    """The text of these rows, held as one list of cells, is over 9 MB."""
    path = saved(tmp_path / "long.csv", lines())
    tracemalloc.start()
    try:
        read_csv(path)
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert most < 2 * ROWS * 5 * 8 + 4e6
