"""Runs that are lost, unreadable or cut, and diagnoses by an old profile: every report says so."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result

from command_line import invoke
from winchkit import UsageError, write_run
from winchkit.catalog import find
from winchkit.fleet import index_library
from winchkit.fleet.library import diagnose
from winchkit.fleet.library.history import library_history
from winchkit.fleet.library.partitions import Partitions
from winchkit.fleet.library.tasks import Outcome, Task
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.winch import WinchProfile

pytest.importorskip("pyarrow")
PATHS = [f"w{winch}/2026-03-0{day}/a.csv" for winch in (1, 2) for day in (1, 2, 3)]


def outcome(task: Task) -> Outcome:
    """A diagnosis that names the cell's gain."""
    session = task.session
    about = {
        "key": task.key, "winch": session.winch, "session": session.session,
        "time": session.time, "runs": [run.path for run in session.runs],
        "profile": task.profile_hash,
    }  # fmt: skip
    estimate = about | {
        "kind": "model", "effect": "cell-gain", "set": ["cell-gain"],
        "certain": True, "value": 0.01,
    }  # fmt: skip
    return Outcome(about | {"verdict": "explained", "failure": None}, (estimate,))


@pytest.fixture
def library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Two winches, three days each; no session is computed."""
    for seed, path in enumerate(PATHS):
        put(tmp_path, path, seed)
    index_library(tmp_path)
    monkeypatch.setattr(diagnose, "outcome_of", outcome)

    def given(runs: list[Run], profile: WinchProfile, *_: object, **__: object) -> tuple[()]:
        return ()

    monkeypatch.setattr("winchkit.fleet.diagnosis.sessions.fit_session", given)
    return tmp_path


def put(library: Path, path: str, seed: int, samples: int = 200) -> None:
    ticks = 0.1 * np.arange(samples)
    angle = np.random.default_rng(seed).normal(size=samples).cumsum()
    about = {"load_mass": "10 kg", "programme": "ladder"}
    (library / path).parent.mkdir(parents=True, exist_ok=True)
    write_run(
        Run("x", ticks, {"motor_angle": Channel(angle, "rad")}, about), library / path, replace=True
    )


def fleet(command: str, library: Path, *arguments: object) -> Result:
    given = ["fleet", command, str(library), "-p", "bench-spiral", *map(str, arguments)]
    return invoke(*given, *["--jobs", "1"] if command == "diagnose" else [])


def reports(library: Path, tmp_path: Path) -> dict[str, Result]:
    page = tmp_path / "page.html"
    effect = ("--effect", "cell-gain")
    return {
        "diagnose": fleet("diagnose", library),
        "diagnose again": fleet("diagnose", library),
        "trend": fleet("trend", library, *effect, "--html", page),
        "trend --json": fleet("trend", library, *effect, "--json"),
    }


def test_a_fleet_without_faults_has_exit_code_0(library: Path, tmp_path: Path) -> None:
    found = reports(library, tmp_path)
    assert {name: result.exit_code for name, result in found.items()} == dict.fromkeys(found, 0)
    assert json.loads(found["trend --json"].stdout)["faults"] == {}


@pytest.mark.parametrize(
    ("harm", "words"),
    [
        ("lost", "no longer in the folder"),
        ("damaged", "is no run"),
        ("cut", "it lasts 9.9 s, the runs of programme 'ladder' with its load last 19.9 s"),
    ],
)
def test_every_report_names_a_run_with_a_fault(
    library: Path, tmp_path: Path, harm: str, words: str
) -> None:
    if harm == "lost":
        (library / PATHS[1]).unlink()
    elif harm == "damaged":
        (library / PATHS[1]).write_text("time [s],motor_angle [rad]\n0,0\n0.1")
        index_library(library)
    else:
        put(library, PATHS[1], 1, samples=100)
        index_library(library)
    for name, result in reports(library, tmp_path).items():
        assert result.exit_code == 1, name
        told = " ".join(result.output.split())
        assert PATHS[1] in told, name
        assert words in told, name
        assert PATHS[0] not in told, name
    page = (tmp_path / "page.html").read_text().replace("\u00a0", " ")
    assert PATHS[1] in page
    assert "Incomplete" in page


def test_a_log_without_its_end_is_cut(library: Path, tmp_path: Path) -> None:
    tables = Partitions(library)

    def harmed(row: dict[str, object]) -> bool:
        return row["path"] == PATHS[4]

    (place,) = [p for p, row in tables.placed("runs", ("path",)) if harmed(row)]
    (row,) = [row for row in tables.read("runs").to_pylist() if harmed(row)]
    tables.change("runs", harmed, [place], [row | {"complete": False}])
    for name, result in reports(library, tmp_path).items():
        assert result.exit_code == 1, name
        told = " ".join(result.output.split())
        assert PATHS[4] in told, name
        assert "was cut: the log has no end" in told, name


def test_rows_by_an_old_profile_are_not_mixed_with_new_ones(library: Path, tmp_path: Path) -> None:
    profile = tmp_path / "own.toml"
    text = find("profiles", "bench-spiral").read_text()
    profile.write_text(text)
    diagnose.diagnose_library(library, profile, jobs=1)
    profile.write_text(text + "\n# measured anew\n")
    with pytest.raises(UsageError, match="6 diagnoses are by other profiles"):
        library_history(library, profile)
    report = diagnose.diagnose_library(library, profile, jobs=1)
    assert (report.diagnosed, report.unchanged) == (6, 0)
    for table in ("diagnoses", "estimates"):
        rows = Partitions(library).read(table, ("runs", "profile")).to_pylist()
        assert sorted(row["runs"] for row in rows) == [[path] for path in PATHS], table
        assert len({row["profile"] for row in rows}) == 1, table
    assert library_history(library, profile).effects == ("cell-gain",)


def test_a_trend_follows_no_effect_of_a_diagnosis_by_another_profile(
    library: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def other(task: Task) -> Outcome:
        found = outcome(task)
        if task.session.winch == "w1":
            return found
        (row,) = found.estimates
        old = {"profile": "0" * 64}
        wrong = row | old | {"effect": "drum-radius", "set": ["drum-radius"]}
        return replace(found, diagnosis=found.diagnosis | old, estimates=(wrong,))

    monkeypatch.setattr(diagnose, "outcome_of", other)
    fleet("diagnose", library)
    result = fleet("trend", library)
    assert result.exit_code == 1
    told = " ".join(result.output.split())
    assert "effects cell-gain " in told
    assert "diagnoses by another profile: 3" in told
