"""Calibrations, tares and points as files: what is written is read back, faults with their line."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, date, datetime
from pathlib import Path

import pytest

from winchkit.calibration.cell.files import calibration_toml, read_points, tares_toml, write_text
from winchkit.errors import FileError
from winchkit.schema.calibration import (
    CalibrationPoint,
    CellCalibration,
    HostTare,
    TareBook,
    tare_book_path,
)
from winchkit.schema.read import read_calibration, read_tares

CALIBRATION = CellCalibration(
    name="cell-A",
    date=date(2026, 11, 21),
    coefficients=(0.123456789, 1.00263264, 8.26e-6),
    device="laumas-tlb",
    serial_number="4711",
    temperature=21.5,
    direction="compression",
    low=0.0,
    high=196.133,
    residual_std=0.0515,
    nonlinearity=0.000372,
    hysteresis=0.0005,
    repeatability=0.00005,
    point=(CalibrationPoint(0.0, 0.12, 0.01), CalibrationPoint(98.0665, 97.95, 0.01, "down", 2)),
)


def test_a_calibration_is_read_back_as_it_was_written(tmp_path: Path) -> None:
    path = write_text(tmp_path / "cell-A.toml", calibration_toml(CALIBRATION))
    assert read_calibration(path) == CALIBRATION


def test_tares_are_read_back_as_they_were_written(tmp_path: Path) -> None:
    taken = datetime(2026, 11, 21, 10, 51, 7, tzinfo=UTC)
    tares = {"A.cell": HostTare(97.8798, 0.0925, taken), "A.length": HostTare(4.4985, 5e-5, taken)}
    book = TareBook("bench", tares)
    path = write_text(tmp_path / "bench.tares.toml", tares_toml(book))
    assert read_tares(path) == book
    assert 'value = "4.4985 m"' in path.read_text(), "a length is none in newtons"


def test_a_tare_in_kilograms_is_refused_at_its_place(tmp_path: Path) -> None:
    path = tmp_path / "b.tares.toml"
    head = 'schema = 1\nkind = "tares"\nname = "b"\n[tare."A.cell"]\n'
    path.write_text(head + 'value = "3 kg"\n')
    with pytest.raises(FileError, match=r"toml:5: tare.*'kg' is a unit of mass, not of force"):
        read_tares(path)


def test_tares_are_kept_beside_the_bench_file() -> None:
    assert tare_book_path("lab/bench.toml") == "lab/bench.tares.toml"


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ("coefficients = [1.0]", "1 given; two"),
        ("coefficients = [0.0, -1.0]", "c1 = -1 is not positive"),
        ('coefficient = "x"', "did you mean 'coefficients'"),
    ],
)
def test_a_calibration_that_cannot_be_right(tmp_path: Path, wrong: str, words: str) -> None:
    path = tmp_path / "c.toml"
    path.write_text(f'schema = 1\nkind = "calibration"\ndate = 2026-11-21\n{wrong}\n')
    with pytest.raises(FileError, match=words):
        read_calibration(path)


def test_points_in_kilograms_go_up_and_down_by_themselves(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text("# hung by hand\nload [kg],indicated [N]\n0,0.1\n5,49.0\n10,98.0\n5,49.2\n")
    points = read_points(path).points
    assert [point.load for point in points] == pytest.approx([0, 49.03325, 98.0665, 49.03325])
    assert [point.going for point in points] == ["up", "up", "up", "down"]
    assert [point.series for point in points] == [1, 1, 1, 1]


def test_a_series_begins_upwards(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    rows = [f"{load},{load},{series}" for series in (1, 2) for load in (0, 5, 10, 5, 0)]
    path.write_text("load [N],indicated [N],series\n" + "\n".join(rows) + "\n")
    assert [point.going for point in read_points(path).points] == [
        "up",
        "up",
        "up",
        "down",
        "down",
    ] * 2


def test_points_say_their_own_direction_series_and_unit(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text("load [kN],indicated [N],going,series,std [mN]\n0.1,99,down,3,20\n")
    assert read_points(path).points == (CalibrationPoint(100.0, 99.0, 0.02, "down", 3),)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("load [kg]\n1\n", "lacks the column indicated"),
        ("load [kg],weight\n1,2\n", "unknown column 'weight'"),
        ("load [m],indicated [N]\n1,2\n", "column 'load .m.' has the unknown unit 'm'; write load"),
        (
            "# x\nload [kg],indicated [N]\n1,2\n2,two\n",
            r"points.csv:4: .*indicated 'two' is no number",
        ),
        ("load [kg],indicated [N]\n1,2\nnan,3\n", r"points.csv:3: .*load 'nan' is no number"),
        ("load [kg],indicatd [N]\n1,2\n", "did you mean 'indicated'"),
        ("load [kg],indicated [N],going\n1,2,left\n", "neither up nor down"),
    ],
)
def test_points_that_cannot_be_read(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "points.csv"
    path.write_text(text)
    with pytest.raises(FileError, match=words):
        read_points(path)


def test_a_file_that_cannot_be_written_leaves_the_old_one(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="cannot be written"):
        write_text(tmp_path / "nowhere" / "c.toml", "x")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("unit", "newton"),
    [("kg", 9.80665), ("g", 9.80665e-3), ("lb", 4.4482216), ("lbf", 4.4482216), ("kip", 4448.2216)],
)
def test_loads_in_any_unit_and_readings_in_counts(unit: str, newton: float, tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    heads = {"reading [counts]": "counts", "Reading": "counts", "reading [mV/V]": "mV/V"}
    for reading, wanted in heads.items():
        path.write_text(f"load [{unit}],{reading}\n0,8212\n5,19158\n")
        found = read_points(path)
        assert found.unit == wanted
        assert [p.load for p in found.points] == pytest.approx([0, 5 * newton])
        assert [p.indicated for p in found.points] == [8212, 19158]


@pytest.mark.parametrize("head", ["load,reading", "load [furlong],reading"])
def test_a_load_without_a_known_unit_is_refused_with_its_column(head: str, tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text(f"# bench 3\n{head}\n0,1\n")
    words = r"points.csv:2: column 'load.*' has .*; write load \[N\], \[kg\], \[lb\]"
    with pytest.raises(FileError, match=words):
        read_points(path)


def test_samples_at_one_load_are_one_point_with_their_noise(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text("load [N],reading [N]\n" + "0,1\n0,3\n0,2\n5,6\n5,8\n0,2\n")
    first, second, last = read_points(path).points
    assert (first.indicated, second.indicated, last.indicated) == (2, 7, 2)
    assert first.std == pytest.approx(1 / 3**0.5)
    assert last.going == "down"


def test_a_calibration_in_counts_is_read_back(tmp_path: Path) -> None:
    points = (CalibrationPoint(0.0, 8212.5, 1.5), CalibrationPoint(98.0665, 30109.0, 1.0))
    own = replace(CALIBRATION, unit="counts", zero_return=-0.001, point=points)
    path = write_text(tmp_path / "c.toml", calibration_toml(own))
    assert read_calibration(path) == own


@pytest.mark.parametrize(
    ("head", "form", "encoding"),
    [
        ("load [kg];reading [counts];series", "{};{};1", "utf-8-sig"),
        ("load [kg];reading [counts]", "{},0;{},5", "utf-8"),
        ("load_kg\treading_counts", "{}\t{}", "utf-16"),
        ("Load (kg),Reading (counts),", "{},{},", "cp1252"),
    ],
)
def test_points_are_read_as_a_spreadsheet_writes_them(
    head: str, form: str, encoding: str, tmp_path: Path
) -> None:
    path = tmp_path / "points.csv"
    lines = [head, *(form.format(k, 8000 + 2200 * k) for k in range(6))]
    path.write_text("\r\n".join(lines) + "\r\n", encoding=encoding)
    found = read_points(path)
    assert found.unit == "counts"
    half = 0.5 if ",5" in form else 0.0
    for k, point in enumerate(found.points):
        assert point.load == pytest.approx(9.80665 * k)
        assert point.indicated == pytest.approx(8000 + 2200 * k + half)


def test_a_comma_that_may_separate_thousands_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text("load [kg],reading [counts]\n" + "".join(
        f'{k},"{8 + 2 * k},{100 + k}"\n' for k in range(6)
    ))  # fmt: skip
    with pytest.raises(FileError, match='"8,100" may have a separator of thousands'):
        read_points(path)


def test_compression_goes_up_with_its_magnitude(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    loads = [0, -5, -10, -5, 0]
    path.write_text("load [kg],reading [counts]\n" + "".join(f"{k},{9 * k}\n" for k in loads))
    assert [point.going for point in read_points(path).points] == ["up"] * 3 + ["down"] * 2
