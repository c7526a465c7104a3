"""``winchkit log info|recover|export|replay`` and what `winchkit log` itself refuses."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result

from command_line import done, invoke, own_process
from fed import recording
from winchkit import catalog
from winchkit.bench.recording.provenance import git_state, origin
from winchkit.cli.core.terminal import HEADS, counter_rows, counter_table
from winchkit.runs import read_run
from winchkit.runs.recording.rotation import Rotation
from winchkit.schema.read import read_simbench


def run(*words: object, code: int = 0) -> Result:
    result = done("log", *words, code=code)
    return result


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "lift.mcap"
    with recording(path, "A", {"load_mass": "15 kg"}) as (fed, recorder):
        fed.run(recorder, 1.0)
        fed.trip("too tight")
        fed.run(recorder, 1.0)
    return path


def test_info_in_words_and_as_json(log: Path) -> None:
    words = run("info", log).stdout
    assert "2 s, closed" in words.splitlines()[0].replace("1.996", "2")
    assert "/A/drive: motor_angle, motor_velocity, motor_torque" in words
    assert "500 samples, 250 Hz" in words
    assert "trip: winch A: too tight" in words
    assert "A.cell: rate" in words
    assert "load_mass: 15 kg" in words
    found = json.loads(run("info", log, "--json").stdout)
    assert found["closed"] is True
    assert [item["samples"] for item in found["sources"]] == [500, 100, 20]
    assert found["counters"]["log"]["drops"] == 0


def test_info_of_a_cut_log_and_its_recovery(log: Path) -> None:
    cut = log.with_name("cut.mcap")
    cut.write_bytes(log.read_bytes()[:-400])
    assert "not closed" in run("info", cut).stdout
    told = run("recover", cut).stdout
    assert told.startswith(f"{log.with_name('cut.recovered.mcap')}: 6")
    assert "messages saved, 0 damaged pieces" in told
    assert json.loads(run("info", log.with_name("cut.recovered.mcap"), "--json").stdout)["closed"]
    again = json.loads(run("recover", cut, "-o", log.with_name("b.mcap"), "--json").stdout)
    assert again["was_whole"] is False
    run("recover", cut, "-o", cut, code=2)
    run("recover", log.with_name("none.mcap"), code=3)


def test_parts_are_exported_as_one(tmp_path: Path) -> None:
    path = tmp_path / "many.mcap"
    with recording(path, "AB", rotation=Rotation(duration=1.0)) as (fed, recorder):
        for _ in range(3):
            fed.run_until_written(recorder, 1.0)
    parts = sorted(tmp_path.glob("many.0*.mcap"))
    assert len(parts) >= 2
    run("export", *parts, "-o", tmp_path / "all.csv")
    run("export", path, "-o", tmp_path / "a.mcap", "--winch", "A")
    whole, winch = read_run(tmp_path / "all.csv"), read_run(tmp_path / "a.mcap")
    assert np.array_equal(whole["A.tension"], winch["tension"])
    assert len(whole) > 140
    result = run("export", path, "-o", tmp_path / "a.xls", code=2)
    assert ".parquet" in result.stderr


def test_a_log_is_not_exported_onto_itself(log: Path) -> None:
    whole = log.read_bytes()
    assert "name another" in run("export", log, "-o", log, code=2).stderr
    assert log.read_bytes() == whole


@pytest.mark.parametrize("suffix", ["csv", "mcap", "mf4", "parquet"])
def test_an_export_writes_over_no_file_unasked(log: Path, suffix: str) -> None:
    earlier = log.with_name(f"earlier.{suffix}")
    earlier.write_bytes(b"another log")
    assert "--replace" in run("export", log, "-o", earlier, code=2).stderr
    assert earlier.read_bytes() == b"another log"


def test_an_export_replaces_a_file_where_asked(log: Path) -> None:
    earlier = log.with_name("earlier.csv")
    earlier.write_bytes(b"another log")
    run("export", log, "-o", earlier, "--replace")
    assert len(read_run(earlier)) == len(read_run(log))


def test_an_earlier_log_is_not_written_over_unasked(log: Path) -> None:
    bench = log.with_name("bench.toml")
    told = run("-b", bench, "-o", log, "--for", "1s", code=2).stderr
    assert "contains a log already" in told
    log.rename(log.with_suffix(".003.mcap"))
    told = run("-b", bench, "-o", log, "--rotate", "1s", "--for", "1s", code=2).stderr
    assert "lift.003.mcap contains a log already" in told, "it would be read as a part of the new"
    run("-b", bench, "-o", log, "--replace", "--for", "1s", code=3)
    assert log.with_suffix(".003.mcap").exists(), "without a bench there is nothing to replace it"
    log.touch()
    log.with_suffix(".003.mcap").unlink()
    run("-b", bench, "-o", log, "--for", "1s", code=3)


def test_parquet_holds_the_rows_with_units(log: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="needs the extra parquet")
    output = log.with_suffix(".parquet")
    run("export", log, "-o", output)
    table, expected = parquet.read_table(output), read_run(log)
    assert table.column("tension").to_numpy() == pytest.approx(expected["tension"])
    assert table.schema.field("tension").metadata == {b"unit": b"N"}
    assert table.schema.metadata[b"load_mass"] == b"15 kg"


def test_mf4_keeps_every_time_stamp(log: Path) -> None:
    asammdf = pytest.importorskip("asammdf", reason="needs the extra mf4")
    output = log.with_suffix(".mf4")
    run("export", log, "-o", output)
    with asammdf.MDF(output) as mdf:
        angle, tension = mdf.get("motor_angle"), mdf.get("tension")
    assert (len(angle.timestamps), len(tension.timestamps)) == (500, 100)
    assert np.diff(angle.timestamps) == pytest.approx(4e-3, abs=1e-6)
    assert (angle.unit, tension.unit) == ("rad", "N")


@pytest.mark.parametrize(("suffix", "library"), [("parquet", "pyarrow"), ("mf4", "asammdf")])
def test_an_extra_that_is_missing_is_named(
    log: Path, suffix: str, library: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, library, None)
    told = run("export", log, "-o", log.with_suffix(f".{suffix}"), code=2).stderr
    assert f"pip install 'winchkit[{suffix}]'" in told


def test_replay_prints_what_the_bench_would(log: Path) -> None:
    result = run("replay", log, "--fast", "--jsonl")
    lines = result.stdout.splitlines()
    assert len(lines) == 500
    assert json.loads(lines[-1])["winch"]["A"]["motor_torque"] == 2.0
    assert "500 pictures" in result.stderr
    table = run("replay", log, "--fast").stderr
    assert "moving" in table, "without a sink it is a table"
    assert "cycle 500" in table, "whose last picture is the log's"
    run("replay", log.with_name("none.csv"), code=3)
    run("replay", log, "--udp", "nowhere", code=2)


@pytest.mark.parametrize(
    ("words", "part"),
    [
        ([], "--bench"),
        (["-b", "bench.toml"], "--output"),
        (["-b", "bench.toml", "--jsonl", "--json", "-o", "a.csv"], "choose one"),
        (["-b", "bench.toml", "-o", "a.csv", "--rotate", "7"], "not a size of a part"),
        (["-b", "bench.toml", "-o", "a.csv", "--udp", "x"], "no HOST:PORT"),
        (["inof"], "did you mean 'info'"),
    ],
)
def test_what_log_refuses_before_it_opens_a_bench(words: list[str], part: str) -> None:
    assert part in run(*words, code=2).stderr


def test_subcommands_have_environment_variables_too(log: Path) -> None:
    result = invoke("log", "info", log, env={"WINCHKIT_LOG_INFO_JSON": "1"})
    assert json.loads(result.stdout)["schema"] == 1


def test_the_counter_row() -> None:
    counted = {
        "A.cell": {
            "rate": 99.9,
            "readings": 5,
            "crc": 2,
            "latency": {"p50": 1e-3, "p99": 2e-3, "worst": float("nan")},
        },
        "log": {"rows": 3},
    }
    (row,) = counter_rows(counted)
    shown = dict(zip(["name", *HEADS], row, strict=True))
    assert shown["rate"] == "99.9"
    assert shown["crc"] == "2"
    assert shown["latency"] == "1/2/—"
    assert shown["drops"] == "—"
    assert counter_table(counted).caption == "rows 3"


def test_git_state_versions_and_calibrations(tmp_path: Path) -> None:
    assert git_state(tmp_path / "nowhere") == {}

    def git(*words: str) -> str:
        about = ["-c", "user.name=n", "-c", "user.email=e@example.org"]
        result = own_process("git", "-C", tmp_path, *about, *words)
        return result.stdout.strip()

    git("init", "-q")
    file = tmp_path / "cell.toml"
    file.write_text("gain = 2.0\n")
    git("add", ".")
    git("commit", "-q", "-m", "x")
    commit = git("rev-parse", "HEAD")
    assert git_state(tmp_path) == {"git": commit}
    file.write_text("gain = 3.0\n")
    assert git_state(tmp_path) == {"git": f"{commit} with changes"}
    bench = read_simbench(catalog.find("sim", "spiral-bench")).bench
    winch = bench.winch["A"]
    assert winch.cell is not None
    calibrated = replace(winch, cell=replace(winch.cell, calibration="cell.toml"))
    about = origin(replace(bench, winch={"A": calibrated}, path=str(tmp_path / "bench.toml")))
    assert about["git"].startswith(commit)
    assert json.loads(about["versions"])["numpy"] == np.__version__
    assert json.loads(about["calibration.A.cell"]) == {"gain": 3.0}
    file.unlink()
    lost = origin(replace(bench, winch={"A": calibrated}, path=str(tmp_path / "bench.toml")))
    assert "cannot be read" in lost["calibration.A.cell"]
