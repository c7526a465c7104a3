"""Every fault of a file at once, with its line; and what a file may not do."""

from __future__ import annotations

import importlib.util
import os
import pickle
import zipfile
from pathlib import Path

import numpy as np
import pytest

from winchkit.errors import RunError, UsageError
from winchkit.runs.importing.answers import Answers
from winchkit.runs.importing.assignment import Guess
from winchkit.runs.importing.formats import source
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.runs import run_of
from winchkit.runs.importing.streams import streams_of
from winchkit.runs.run import Run

HEAD = "time [s];angle [deg];torque [Nm]"


def rows(count: int = 30) -> list[str]:
    return [f"{0.01 * k:.2f};{k};{1 + 0.1 * k:.1f}" for k in range(count)]


def guessed(path: Path, lines: list[str], end: str = "\n") -> Guess:
    path.write_text("\n".join(lines) + end, encoding="utf-8")
    return guess_columns(read_table(path))


def run(path: Path, lines: list[str], end: str = "\n") -> Run:
    return run_of(streams_of(guessed(path, lines, end)), {})


def test_all_faults_are_reported_at_once_with_their_lines(tmp_path: Path) -> None:
    lines = [HEAD, *rows()]
    lines[4] = "0.03;three;1.3"
    lines[9] = "0.08;8;OVERRANGE"
    lines[14] = "0.13;13"
    lines[20] = "0.19;19;2.9;7"
    with pytest.raises(RunError) as caught:
        run(tmp_path / "log.csv", lines)
    found = {fault.line: fault.message for fault in caught.value.faults}
    assert sorted(found) == [5, 10, 15, 21]  # type: ignore[type-var]
    assert "'three', not a number" in found[5]
    assert "'OVERRANGE'" in found[10]
    assert "2 cells in this row, 3 in the others" in found[15]


def test_times_that_stand_still_have_their_lines(tmp_path: Path) -> None:
    lines = ["title", "", HEAD, *rows()]
    lines[10] = lines[10].replace("0.07;", "0.06;")
    lines[20] = lines[20].replace("0.17;", "0.10;")
    with pytest.raises(RunError) as caught:
        run(tmp_path / "log.csv", lines)
    assert [fault.line for fault in caught.value.faults] == [11, 21]
    assert "stands still at 0.06 s" in caught.value.faults[0].message


def test_a_clock_coarser_than_the_sampling_is_named_with_its_option(tmp_path: Path) -> None:
    lines = [HEAD, *(f"{k // 10 / 10:.1f};{k};1" for k in range(100))]
    with pytest.raises(RunError, match=r"90 of 100 time stamps repeat.*--sample-rate \"100 Hz\""):
        run(tmp_path / "log.csv", lines)
    guess = guess_columns(read_table(tmp_path / "log.csv"), Answers(sample_rate=100.0))
    found = run_of(streams_of(guess), {})
    assert found.time == pytest.approx(np.arange(100) / 100)


def test_faults_of_unused_columns_do_not_matter(tmp_path: Path) -> None:
    lines = [f"{HEAD};Status", *(f"{row};{'ok' if k % 7 else 3}" for k, row in enumerate(rows()))]
    assert len(run(tmp_path / "log.csv", lines)) == 30


def test_a_header_with_more_numbers_than_the_rows_ends_at_its_mark(tmp_path: Path) -> None:
    """LabVIEW: the rows of a short recording are fewer than the numeric lines of the header."""
    mark = "***End_of_Header***"
    head = ["LabVIEW Measurement", "Separator\tTab", mark, "", "Channels\t3", "Samples\t5\t5\t5"]
    head += [f"{key}\t0.01\t0.01\t0.01" for key in ("X0", "Delta_X", "Gain", "Zero")]
    head += [mark, "X_Value\tAngle (deg)\tUntitled\tForce (N)\tComment"]
    lines = [*head, *(f"{0.01 * k:.2f}\t{k}\t\t{100 + k}" for k in range(5))]
    found = run(tmp_path / "log.lvm", lines)
    assert len(found) == 5
    assert set(found) == {"motor_angle", "tension"}
    assert found["tension"].tolist() == [100, 101, 102, 103, 104]


def test_repeated_rows_are_left_out_with_a_note(tmp_path: Path) -> None:
    lines = [HEAD, *rows()]
    lines.insert(5, lines[4])
    found = run(tmp_path / "log.csv", lines)
    assert len(found) == 30
    assert any("repeat the row before them" in note for note in found.notes)


def test_missing_values_stay_missing(tmp_path: Path) -> None:
    lines = [HEAD, *rows()]
    for line, text in ((3, ""), (6, "NaN"), (9, "#NV"), (12, "---"), (15, "n/a")):
        lines[line] = f"{0.01 * (line - 1):.2f};{line};{text}"
    found = run(tmp_path / "log.csv", lines)
    assert np.flatnonzero(np.isnan(found["motor_torque"])).tolist() == [2, 5, 8, 11, 14]


def test_a_cut_off_last_row_is_left_out_with_a_note(tmp_path: Path) -> None:
    found = run(tmp_path / "log.csv", [HEAD, *rows(), "0.30;3"], end="")
    assert len(found) == 30
    assert any("no line end" in note for note in found.notes)


def test_one_clock_with_rows_in_between_of_a_rate_of_its_own(tmp_path: Path) -> None:
    """A temperature once a second is interpolated and does not thin the rows."""
    lines = [f"{HEAD};temperature [°C]"]
    for k, row in enumerate(rows(300)):
        lines.append(f"{row};{20 + 0.01 * k:.4f}" if k % 100 == 0 else f"{row};")
    found = run(tmp_path / "log.csv", lines)
    assert len(found) == 300
    assert found["temperature"][150] == pytest.approx(21.5)
    assert np.isnan(found["temperature"][250])


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (b"", "the file is empty"),
        (b"just some words\nand more\n", "no rows of numbers"),
        (bytes(range(256)) * 20, "binary file of an unknown format"),
        (b"\x1f\x8b\x08\x00", "compressed by gzip"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1", "old Excel file"),
        (b"TDSm....", "has no channels with numbers"),
        (b"MDF     broken", "not a readable MDF file"),
        (b"PK\x03\x04broken", "damaged ZIP"),
        (b"MATLAB 5.0 MAT-file" + b" " * 109, "not a readable MAT file"),
        (b"PAR1broken", "not a readable Parquet file"),
        (b"\x93NUMPYbroken", "not a readable NumPy file"),
        (b"\x89MCAP0\r\nbroken", "not a readable MCAP file"),
        (b"\x89HDF\r\n\x1a\nbroken", "not a readable HDF5 file"),
    ],
)
def test_files_that_cannot_be_read_are_refused_in_words(
    content: bytes, text: str, tmp_path: Path
) -> None:
    for needed, mark in (
        ("pyarrow", b"PAR1"),
        ("h5py", b"\x89HDF"),
        ("nptdms", b"TDSm"),
        ("asammdf", b"MDF "),
    ):
        if content.startswith(mark) and importlib.util.find_spec(needed) is None:
            pytest.skip(f"needs {needed}")
    path = tmp_path / "log.bin"
    path.write_bytes(content)
    with pytest.raises(RunError, match=text):
        read_table(path)


def test_a_missing_file_a_folder_and_a_fifo_are_refused(tmp_path: Path) -> None:
    with pytest.raises(RunError, match="no such file"):
        read_table(tmp_path / "none.csv")
    with pytest.raises(RunError, match="is a folder"):
        read_table(tmp_path)
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe")
        with pytest.raises(RunError, match="FIFO"):
            read_table(tmp_path / "pipe")


class _Marker:
    """An object whose unpickling writes a file."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[object, tuple[str, str]]:
        return (os.rename, (str(self.path), f"{self.path}.executed"))


def test_pickled_objects_are_refused_and_not_executed(tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    mark.write_text("here")
    array = np.array([_Marker(mark)], dtype=object)
    path = tmp_path / "log.npz"
    np.savez(path, t=np.arange(5.0), x=array)
    assert b"rename" in pickle.dumps(_Marker(mark))
    with pytest.raises(RunError, match="Python objects, which may hold code"):
        read_table(path)
    assert mark.exists()


def test_an_archive_larger_than_the_limit_is_not_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from winchkit.runs.importing import table

    monkeypatch.setattr(table, "LARGEST", 1_000_000)
    path = tmp_path / "log.npz"
    np.savez_compressed(path, t=np.zeros(1_000_000))
    assert path.stat().st_size < 20_000
    with pytest.raises(RunError, match=r"arrays of 0\.008 GB"):
        read_table(path)


def test_an_archive_of_other_files_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.zip"
    with zipfile.ZipFile(path, "w") as packed:
        packed.writestr("a.csv", "1,2\n")
    with pytest.raises(RunError, match=r"archive of a\.csv"):
        read_table(path)


@pytest.mark.parametrize(
    ("module", "content", "extra"),
    [("openpyxl", None, "xlsx"), ("h5py", source._HDF5, "hdf5"), ("pyarrow", b"PAR1", "parquet")],
)
def test_a_missing_library_is_named_with_its_extra(
    module: str, content: bytes | None, extra: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "log"
    if content is None:
        with zipfile.ZipFile(path, "w") as packed:
            packed.writestr("xl/workbook.xml", "")
    else:
        path.write_bytes(content)
    monkeypatch.setitem(__import__("sys").modules, module, None)
    with pytest.raises(UsageError, match=rf"pip install 'winchkit\[{extra}\]'"):
        read_table(path)


def test_times_of_faults_are_those_of_the_file(tmp_path: Path) -> None:
    """A test stand writes a row of the last test first; its channels have rates of their own."""
    lines = ["time [s],angle [deg],torque [Nm]", "2.445,1,"]
    lines += [f"{0.01 * k:.2f},{k},{'' if k % 3 else k}" for k in range(40)]
    with pytest.raises(RunError) as caught:
        run(tmp_path / "log.csv", lines)
    (fault,) = caught.value.faults
    assert fault.line == 3
    assert fault.message.startswith("time goes back from 2.445 s to 0 s; rows must come in order")


def test_json_that_is_cut_off_damaged_or_without_lists_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.json"
    record = '{"t": 0.1, "angle [deg]": 3}'
    for text, message in (
        (f'{{"entries": [{record}, {record}, {{"t"', "is the file cut off"),
        ('{"kp": 3, "name": "m7"}', "JSON without a list of records"),
        (f"{record}\n{record}\nnothing\n{record}\n", "no record of JSON"),
        ("{ this is no JSON }", "no rows of numbers"),
    ):
        path.write_text(text)
        with pytest.raises(RunError, match=message):
            read_table(path)
    path.write_text(f'{record}\n{record}\n{{"t": 0.3')
    table = read_table(path)
    assert [len(column) for column in table.columns] == [2, 2]
    assert "cut off" in table.notes[0]


def test_records_may_lack_fields_and_rows_be_of_unequal_length(tmp_path: Path) -> None:
    path = tmp_path / "log.json"
    path.write_text('[{"t": 0, "a": 1}, {"t": 1, "b": null}, {"t": 2, "a": true}]')
    columns = {c.name: c.values.tolist() for c in read_table(path).columns}
    assert columns["t"] == [0.0, 1.0, 2.0]
    assert columns["a"][::2] == [1.0, 1.0]
    assert np.isnan(columns["a"][1])
    path.write_text("[[0, 1, 2], [1, 1], [2, 5, 6]]")
    assert [len(c) for c in read_table(path).columns] == [3, 3]


def test_empty_rows_below_a_sheet_are_left_out(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(["time [s]", "angle [deg]"])
    for k in range(20):
        sheet.append([0.1 * k, 3.0 * k])
    sheet.cell(row=900, column=5).number_format = "0.00"
    book.save(tmp_path / "log.xlsx")
    assert [len(c) for c in read_table(tmp_path / "log.xlsx").columns] == [20, 20]


def test_few_repeated_stamps_are_left_out_with_a_note(tmp_path: Path) -> None:
    stamps = [0.01 * k for k in range(400)]
    stamps[200] = stamps[199]
    stamps[300] = stamps[299]
    lines = ["time [s];angle [deg]", *(f"{t:.2f};{k}" for k, t in enumerate(stamps))]
    found = streams_of(guessed(tmp_path / "log.csv", lines))
    assert found.notes == ("2 of 400 rows have the stamp of the row before them and are left out",)
    assert len(run_of(found, {})) == 398


def test_records_of_several_kinds_are_refused_and_no_long_header(tmp_path: Path) -> None:
    """A set point between the samples; the last samples are at rest, without set points."""
    lines = []
    for n in range(400):
        lines += [f"{0.01 * n:.2f},{n},1.5,2.5", f"Set: {n}, 3.5"]
        lines += [f"Set: {n}, 4.5"] * 3
    lines += [f"{4 + 0.01 * n:.2f},400,1.5,2.5" for n in range(100)]
    with pytest.raises(RunError) as caught:
        guessed(tmp_path / "log.csv", lines)
    (fault,) = caught.value.faults
    assert "400 rows of 4 cells stand between lines of another kind" in fault.message
    assert fault.line == 2001
    samples = [line for line in lines if not line.startswith("Set")]
    found = guessed(tmp_path / "samples.csv", samples)
    assert len(found.file.columns[0].values) == 500


def test_messages_of_the_controller_between_the_rows_are_left_out(tmp_path: Path) -> None:
    lines = [HEAD, *rows()]
    lines[7:7] = ["START TRAJECTORY"]
    lines[15:15] = ["warning: cable 3 slack", "fault; 2"]
    with pytest.raises(RunError) as caught:
        run(tmp_path / "log.csv", lines)
    (fault,) = caught.value.faults
    assert fault.line == 17
    del lines[16]
    found = guessed(tmp_path / "log.csv", lines)
    assert any("2 lines of words" in note for note in found.table.notes)
