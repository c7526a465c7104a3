"""CSV files of many rows: read a block at a time, faults still at their lines."""

from __future__ import annotations

import tracemalloc
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.errors import RunError
from winchkit.runs.formats import csv_read
from winchkit.runs.formats.csv_read import _arrow_parser, _numpy_columns, _plain, read_csv

PARSERS = [_numpy_columns]
with suppress(ImportError):
    PARSERS.append(_arrow_parser())
ROWS = 30_000
HEADER = "time [s],motor_angle [rad],tension [N],load [N],remark"


def lines() -> list[str]:
    return [f"{0.001 * n:.3f},{0.25 * n},{1e-3 * n},{n % 7}.5,{n}" for n in range(ROWS)]


def saved(path: Path, rows: list[str]) -> Path:
    path.write_text("\n".join(["# load_mass: 3 kg", HEADER, *rows]) + "\n", encoding="utf-8")
    return path


@pytest.fixture(params=["numpy", "arrow"])
def _either_parser(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Files are never as large as Arrow needs, or always."""
    if request.param == "arrow":
        pytest.importorskip("pyarrow")
    monkeypatch.setattr(csv_read, "_LARGE", 0 if request.param == "arrow" else 1 << 40)


@pytest.mark.usefixtures("_either_parser")
def test_every_row_is_there_in_its_order(tmp_path: Path) -> None:
    run = read_csv(saved(tmp_path / "long.csv", lines()))
    number = np.arange(ROWS)
    np.testing.assert_array_equal(run["motor_angle"], 0.25 * number)
    np.testing.assert_array_equal(run["load"], number % 7 + 0.5)
    np.testing.assert_array_equal(run["remark"], number)


@pytest.mark.usefixtures("_either_parser")
def test_a_wrong_cell_far_down_is_reported_with_its_line(tmp_path: Path) -> None:
    rows = lines()
    rows[4095] = "4.095,x,1,1,1"
    rows[12_345] = "12.345,1,y,1,1"
    with pytest.raises(RunError) as told:
        read_csv(saved(tmp_path / "wrong.csv", rows))
    assert [fault.line for fault in told.value.faults] == [4095 + 3, 12_345 + 3]


@pytest.mark.usefixtures("_either_parser")
def test_a_cell_over_two_lines_at_the_end_of_a_block_is_one_cell(tmp_path: Path) -> None:
    rows = lines()
    rows[4095] = '4.095,1,2,3,"begun\nanew"'
    rows[9000] = "9.000,1,2,wrong,5"
    with pytest.raises(RunError) as told:
        read_csv(saved(tmp_path / "two.csv", rows))
    assert [fault.line for fault in told.value.faults] == [9000 + 4]


@pytest.mark.usefixtures("_either_parser")
def test_events_gaps_and_blank_lines_between_blocks_of_numbers(tmp_path: Path) -> None:
    rows = lines()
    rows[5000] = f"5.000,,1,2,{5000}"
    rows.insert(9000, "# event 9.000 s: {}")
    rows.insert(15_000, "")
    rows.insert(15_001, "# a remark")
    run = read_csv(saved(tmp_path / "events.csv", rows))
    np.testing.assert_array_equal(run["remark"], np.arange(ROWS))
    assert list(np.flatnonzero(np.isnan(run["motor_angle"]))) == [5000]


NUMBERS = st.floats() | st.sampled_from([1e-320, 5e-324, 1.7976931348623157e308, -0.0, 0.1 + 0.2])


@pytest.mark.parametrize("parser", PARSERS)
@pytest.mark.parametrize("form", ["r", ".17g", ".3e", "+.6f"])
@given(values=st.lists(NUMBERS, min_size=1, max_size=20))
def test_numbers_are_read_as_python_reads_them(
    parser: csv_read.Parser, form: str, values: list[float]
) -> None:
    texts = [repr(value) if form == "r" else format(value, form) for value in values]
    read = _plain([f"{text},1\n" for text in texts], 2, parser)
    np.testing.assert_array_equal(read[0], [float(text) for text in texts])


@pytest.mark.parametrize("parser", PARSERS)
@pytest.mark.parametrize(
    "rows",
    [
        ["1,2\n", "3\n"],
        ["1,2,3\n"],
        ["1_0,2\n"],
        ["1,2\n", "\n"],
        ["\n", "1,2\n"],
        ["1,fain\n"],
        ["0x1,2\n"],
        ['"1",2\n'],
        ["1,2\n3,\n4\n"],
    ],
)
def test_other_lines_are_not_taken_for_numbers(parser: csv_read.Parser, rows: list[str]) -> None:
    assert _plain(rows, 2, parser) is None


@pytest.mark.usefixtures("_either_parser")
def test_text_far_down_makes_an_unknown_column_text(tmp_path: Path) -> None:
    rows = lines()
    rows[20_000] = "20.000,1,1,1,begun anew"
    run = read_csv(saved(tmp_path / "text.csv", rows))
    assert "remark" not in run
    assert any("'remark' contains text" in note for note in run.notes)


@pytest.mark.usefixtures("_either_parser")
def test_a_file_cut_off_far_down_is_reported_so(tmp_path: Path) -> None:
    with pytest.raises(RunError) as told:
        read_csv(saved(tmp_path / "cut.csv", [*lines(), "30.0,1"]))
    (fault,) = told.value.faults
    assert fault.line == ROWS + 3
    assert "is the file cut off?" in fault.message


@pytest.mark.usefixtures("_either_parser")
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
