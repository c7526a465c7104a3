"""CSV files that were cut off: what is a row, what is not, and what is said of it."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from command_line import done, invoke
from winchkit.errors import RunError
from winchkit.runs import open_writer, read_run
from winchkit.runs.recover import recover

COLUMNS = [("time", "s"), ("motor_angle", "rad"), ("temperature", "degC")]
FOREIGN = "time [s],motor_angle [rad],temperature [degC]\n0,0,20.0\n0.1,1,20.0\n0.2,2,20.0"


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "lift.csv"
    with open_writer(path, COLUMNS, {"load_mass": "15 kg"}) as writer:
        for n in range(8):
            writer.append({"time": n * 0.125, "motor_angle": n / 3, "temperature": 20.0})
    return path


def rows_by_csv(data: bytes) -> list[list[float]]:
    """The whole lines after the header, by Python's own reader."""
    lines = data[: data.rfind(b"\n") + 1].decode().splitlines()
    _, *rows = csv.reader(line for line in lines if not line.startswith("#"))
    return [[float(cell) for cell in row] for row in rows]


def test_a_log_cut_at_any_byte_gives_its_whole_rows(log: Path) -> None:
    data = log.read_bytes()
    header_end = data.index(b"\n", data.index(b"time [s]")) + 1
    for length in range(1, len(data) + 1):
        cut = data[:length]
        log.write_bytes(cut)
        expected = rows_by_csv(cut) if length >= header_end else []
        if len(expected) < 2:
            with pytest.raises(RunError):
                read_run(log)
            continue
        run = read_run(log)
        found = [list(row) for row in zip(run.time, *(run[name] for name in run), strict=True)]
        assert [row[:2] for row in found] == [row[:2] for row in expected]
        assert {row[2] for row in found} == {20.0}
        (note,) = run.notes or ("",)
        assert ("winchkit log recover" in note) is not cut.endswith(b"\n")


def test_check_warns_of_a_cut_log_and_names_what_helps(log: Path) -> None:
    """20.0 degC cut to 2 degC is no reading of 2 degC."""
    data = log.read_bytes()
    assert data.endswith(b",20.0\n")
    log.write_bytes(data[: -len("0.0\n")])
    result = done("check", log)
    assert "7 rows" in result.stdout
    assert f"`winchkit log recover {log}`" in result.stderr
    assert "(warning)" in result.stderr
    told = invoke("log", "info", log)
    assert "the file is cut off" in told.stdout
    assert read_run(recover(log).output)["temperature"].tolist() == [20.0] * 7


def test_a_log_cut_within_its_header_is_refused_with_words(log: Path) -> None:
    data = log.read_bytes()
    log.write_bytes(data[: data.index(b"temperature")])
    with pytest.raises(RunError, match="cut off within its header; there is no row to recover"):
        read_run(log)


def test_another_programs_file_keeps_a_last_row_that_is_complete(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    for text in (FOREIGN, FOREIGN.replace("\n", "\r\n"), FOREIGN.replace("\n", "\r")):
        path.write_bytes(text.encode())
        run = read_run(path)
        assert run["temperature"].tolist() == [20.0, 20.0, 20.0]
        (note,) = run.notes
        assert "no line end" in note
        assert "may lack digits" in note
    for whole in (FOREIGN + "\n", FOREIGN + "\r\n", FOREIGN + "\n  "):
        path.write_bytes(whole.encode())
        run = read_run(path)
        assert (len(run), run.notes) == (3, ())


@pytest.mark.parametrize("cut", [6, 5, 7, 8])
def test_another_programs_last_line_without_every_column_is_no_row(
    tmp_path: Path, cut: int
) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(FOREIGN.encode()[:-cut])
    run = read_run(path)
    assert run["motor_angle"].tolist() == [0.0, 1.0]
    (note,) = run.notes
    assert "is left out" in note


def test_a_last_cell_in_utf16(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(FOREIGN.encode("utf-16"))
    assert len(read_run(path)) == 3
