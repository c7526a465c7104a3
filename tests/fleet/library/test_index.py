"""Index of a library: what is read, kept, removed; kills, full disks, two writers, readers."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from waiting import run_together
from winchkit import FileError, UsageError, open_writer, write_run
from winchkit.fleet import index_library, library_runs, query_library
from winchkit.fleet.library.index import IndexReport
from winchkit.fleet.library.partitions import FOLDER, Partitions
from winchkit.fleet.library.tables import TABLES, arrow_schema
from winchkit.runs.run import Channel, Run

pytest.importorskip("pyarrow")
ROOT = Path(__file__).parents[3]
KINDS = {
    "string": "string",
    "list<item: string>": "list of string",
    "list<element: string>": "list of string",
    "double": "double",
    "list<item: double>": "list of double",
    "list<element: double>": "list of double",
    "int64": "int64",
    "bool": "bool",
    "timestamp[us, tz=UTC]": "timestamp[us, UTC]",
}


def a_run(seed: int = 0, **metadata: str) -> Run:
    time = np.arange(20) * 0.1
    angle = np.random.default_rng(seed).normal(size=20).cumsum()
    channels = {"motor_angle": Channel(angle, "rad"), "tension": Channel(100 + angle, "N")}
    return Run("lift", time, channels, {"load_mass": "10 kg", "programme": "ladder", **metadata})


def put(library: Path, path: str, seed: int = 0, **metadata: str) -> Path:
    file = library / path
    file.parent.mkdir(parents=True, exist_ok=True)
    write_run(a_run(seed, **metadata), file, replace=True)
    return file


def paths(library: Path) -> list[str]:
    return library_runs(library).column("path").to_pylist()


@pytest.fixture
def library(tmp_path: Path) -> Path:
    put(tmp_path, "w1/2026-03-01/a.csv", 1)
    put(tmp_path, "w1/2026-03-01/b.mcap", 2)
    put(tmp_path, "w2/c.csv", 3, start_time="2026-04-02T10:00:00+02:00", session="morning")
    return tmp_path


def test_a_row_has_the_facts_of_its_run(library: Path) -> None:
    index_library(library, "bench-spiral")
    first, _, third = library_runs(library).to_pylist()
    assert (first["winch"], first["session"], first["load_mass"]) == ("w1", "2026-03-01", 10.0)
    assert first["time_source"] == "path"
    assert first["profile_name"] == "bench-spiral"
    assert first["duration"] == pytest.approx(1.9)
    assert third["session"] == "morning"
    assert third["time"].isoformat() == "2026-04-02T08:00:00+00:00"
    assert (library / FOLDER / "runs" / "w2" / "2026-04.parquet").exists()


@pytest.mark.parametrize(
    ("path", "metadata", "time", "source"),
    [
        ("w/x.csv", {"source Date": "2026-03-01 14:30:05"}, "2026-03-01T14:30:05", "metadata"),
        ("w/x.csv", {"date": "2026-03-01", "time": "9:30"}, "2026-03-01T09:30:00", "metadata"),
        ("w/x.csv", {"recorded": "2026-03-01T09:30:00+00:00"}, "2026-03-01T09:30:00", "metadata"),
        (
            "w/x.csv",
            {"source Date": "1.3.2026", "source Time": "14:30:05"},
            "2026-03-01T14:30:05",
            "metadata",
        ),
        ("w/trip-20260301-143005.csv", {}, "2026-03-01T14:30:05", "path"),
        ("w/2026-03-01_1430.csv", {}, "2026-03-01T14:30:00", "path"),
        ("w/2026-03-01/x.csv", {}, "2026-03-01T00:00:00", "path"),
        ("w/20269901-12.csv", {}, None, "file"),
        ("w/x.csv", {"source Date": "03/01/2026"}, None, "file"),
    ],
)
def test_the_time_of_a_run_is_that_of_its_file_or_path(
    tmp_path: Path, path: str, metadata: dict[str, str], time: str | None, source: str
) -> None:
    put(tmp_path, path, **metadata)
    index_library(tmp_path)
    (row,) = library_runs(tmp_path).to_pylist()
    assert row["time_source"] == source
    assert time is None or row["time"].isoformat() == f"{time}+00:00"


def test_an_imported_run_with_the_name_of_its_source_stays_in_the_index(tmp_path: Path) -> None:
    put(tmp_path, "imported/log.csv", imported_from="log.csv")
    assert index_library(tmp_path).indexed == ("imported/log.csv",)
    assert paths(tmp_path) == ["imported/log.csv"]


def test_nothing_is_read_twice_and_a_changed_file_is_read_again(library: Path) -> None:
    assert len(index_library(library).indexed) == 3
    assert index_library(library) == IndexReport((), 3, ())
    put(library, "w1/2026-03-01/a.csv", 9).touch()
    (library / "w2" / "c.csv").unlink()
    report = index_library(library)
    assert report.indexed == ("w1/2026-03-01/a.csv",)
    assert report.removed == ("w2/c.csv",)
    assert paths(library) == ["w1/2026-03-01/a.csv", "w1/2026-03-01/b.mcap"]


def test_a_half_written_file_is_named_and_read_when_it_is_whole(library: Path) -> None:
    with open_writer(library / "w1" / "d.csv", [("time", "s"), ("motor_angle", "rad")]) as log:
        log.append({"time": 0.0, "motor_angle": 0.0})
        log.flush()
        assert "is being recorded" in index_library(library).faults["w1/d.csv"]
        log.append({"time": 0.1, "motor_angle": 0.1})
    assert index_library(library).indexed == ("w1/d.csv",)
    assert paths(library).count("w1/d.csv") == 1


def test_the_tables_are_rebuilt_from_the_files(library: Path) -> None:
    index_library(library)
    before = library_runs(library)
    part = next((library / FOLDER).glob("runs/w1/*.parquet"))
    part.write_bytes(part.read_bytes()[:100])  # a damaged partition
    assert len(index_library(library).indexed) == 2
    assert library_runs(library).equals(before)


def test_columns_of_several_winches_are_rows_of_their_own(tmp_path: Path) -> None:
    run = a_run()
    both = {f"{w}.{name}": item for name, item in run.channels.items() for w in "AB"}
    (tmp_path / "hall").mkdir()
    write_run(Run("x", run.time, both, run.metadata), tmp_path / "hall" / "x.csv")
    index_library(tmp_path)
    assert library_runs(tmp_path).column("winch").to_pylist() == ["hall/A", "hall/B"]
    assert len(library_runs(tmp_path, winch="hall/A")) == 1


def test_a_file_of_another_program_is_read_by_the_mapping_above_it(tmp_path: Path) -> None:
    (tmp_path / "w1" / "x").mkdir(parents=True)
    (tmp_path / "w1" / "map.toml").write_text(
        'schema = 1\nkind = "mapping"\nname = "ours"\n[[log]]\nname = "l"\n'
        '[[log.column]]\nsource = "t"\nchannel = "time"\nunit = "s"\n'
        '[[log.column]]\nsource = "phi"\nchannel = "motor_angle"\nunit = "deg"\n'
    )
    rows = "".join(f"{0.1 * n:.1f}\t{n}\n" for n in range(30))
    (tmp_path / "w1" / "x" / "log.txt").write_text(f"t\tphi\n{rows}")
    index_library(tmp_path)
    (row,) = library_runs(tmp_path).to_pylist()
    assert (row["fault"], row["samples"], row["winch"]) == (None, 30, "w1")
    assert row["mapping"].endswith("map.toml")
    put(tmp_path, "w1/x/run.csv", imported_from="log.txt")
    index_library(tmp_path)
    assert paths(tmp_path) == ["w1/x/run.csv"]  # its source is not a second run


def test_a_full_disk_loses_no_row_that_was_there(library: Path) -> None:
    index_library(library)
    before = library_runs(library)
    put(library, "w1/2026-03-01/new.csv", 7)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        with pytest.raises(FileError, match="cannot be written"):
            index_library(library)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert library_runs(library).equals(before)
    assert index_library(library).indexed == ("w1/2026-03-01/new.csv",)


def test_two_writers_at_once_give_every_run_once(library: Path) -> None:
    reports: list[IndexReport] = []
    threads = [
        threading.Thread(target=lambda: reports.append(index_library(library))) for _ in range(2)
    ]
    run_together(threads)
    assert sorted(len(report.indexed) for report in reports) == [0, 3]
    assert len(paths(library)) == 3


@pytest.mark.slow
def test_killed_at_any_moment_the_next_index_completes_it(tmp_path: Path) -> None:
    expected = [put(tmp_path, f"w{n % 3}/{n:02d}.csv", n) for n in range(30)]
    code = (
        "import sys, winchkit.fleet.library.index as index; index._COMMIT = 0.0; "
        "index.index_library(sys.argv[1])"
    )
    for delay in (0.6, 0.8, 1.0, 1.2):
        process = subprocess.Popen(
            [sys.executable, "-c", code, str(tmp_path)], env={**os.environ, "PYTHONPATH": str(ROOT)}
        )
        try:
            process.wait(delay)
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGKILL)
            process.wait()
        if any((tmp_path / FOLDER / "runs").rglob("*.parquet")):  # else it is an error of the file
            found = paths(tmp_path)
            assert len(set(found)) == len(found)
    index_library(tmp_path)
    assert sorted(paths(tmp_path)) == sorted(str(p.relative_to(tmp_path)) for p in expected)


def test_other_readers_see_the_same_rows(library: Path) -> None:
    index_library(library)
    glob = str(library / FOLDER / "runs" / "*" / "*.parquet")
    own = sorted(paths(library))
    polars = pytest.importorskip("polars")
    assert sorted(polars.read_parquet(glob)["path"].to_list()) == own
    pandas = pytest.importorskip("pandas")
    assert sorted(pandas.read_parquet(library / FOLDER / "runs")["path"]) == own
    duckdb = pytest.importorskip("duckdb")
    rows = duckdb.sql(f"SELECT path FROM read_parquet('{glob}') ORDER BY path").fetchall()
    assert [row[0] for row in rows] == own


def test_sql_reads_the_tables_and_nothing_else(library: Path) -> None:
    pytest.importorskip("duckdb")
    index_library(library)
    found = query_library(library, "SELECT winch, count(*) AS n FROM runs GROUP BY 1 ORDER BY 1")
    assert found.to_pylist() == [{"winch": "w1", "n": 2}, {"winch": "w2", "n": 1}]
    assert query_library(library, "SELECT * FROM estimates").num_rows == 0
    outside = library.parent / "secret.csv"
    for sql in (
        f"COPY runs TO '{outside}'",
        "SELECT 1; SELECT 2",
        "DROP VIEW runs",
        "SELECT nothing FROM runs",
        f"SELECT * FROM read_csv('{ROOT / 'pyproject.toml'}')",
    ):
        with pytest.raises(UsageError, match="SQL"):
            query_library(library, sql)
    assert not outside.exists()


def test_a_folder_without_an_index_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="winchkit library index"):
        library_runs(tmp_path)
    with pytest.raises(FileError, match="no such folder"):
        index_library(tmp_path / "nowhere")


@pytest.mark.parametrize("table", TABLES)
def test_the_page_lists_the_columns_of_a_table(table: str) -> None:
    page = (ROOT / "docs" / "formats.md").read_text(encoding="utf-8")
    section = page.split(f"### Table `{table}`")[1].split("\n#")[0]
    lines = [line.split(" | ") for line in section.splitlines() if line.startswith("| `")]
    shown = [(line[0].strip("|` "), line[1].split(",")[0]) for line in lines]
    expected = [(f.name, KINDS[str(f.type)].split(",")[0]) for f in arrow_schema(table)]
    assert shown == expected


def test_a_name_of_a_winch_is_one_folder(tmp_path: Path) -> None:
    from datetime import UTC, datetime

    moment = datetime(2026, 1, 1, tzinfo=UTC)
    places = [
        Partitions(tmp_path).place("runs", {"winch": name, "time": moment}).parent
        for name in ("", "a/b", "..", "%", "a b")
    ]
    assert len(set(places)) == 5
    assert {place.parent for place in places} == {tmp_path / FOLDER / "runs"}
