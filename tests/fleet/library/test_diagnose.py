"""Diagnoses of a library: what is kept, repeated and removed; full disks, clusters, clients."""

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from command_line import done
from winchkit import FileError, open_writer, write_run
from winchkit.errors import ConnectionLost
from winchkit.fleet import diagnose_library, index_library
from winchkit.fleet.library import cluster, diagnose
from winchkit.fleet.library.cluster import cluster_outcomes
from winchkit.fleet.library.history import library_history
from winchkit.fleet.library.partitions import Partitions
from winchkit.fleet.library.sessions import WinchSession
from winchkit.fleet.library.tasks import Outcome, Task, failed, outcome_of, stored_result
from winchkit.runs.run import Channel, Run

pytest.importorskip("pyarrow")
START = datetime(2026, 1, 5, tzinfo=UTC)
OWN = """
import numpy as np
from winchkit import Effect, Parameter
from winchkit.model.stages import Stage

def apply(torque, at, values):
    return torque + values["amplitude"] * np.sin(3 * at.drum_angle)

MINE = Effect(
    id="third-harmonic", stage=Stage.MOTOR, apply=apply, outputs=("motor_torque",),
    parameters=(Parameter("amplitude", "N m", null=0.0, typical=1e-2),), what="Mine.",
    formula="t + a sin 3p", source="me", looks_like="A sine.", told_apart="Ask me.",
)
"""
"""A user's own file of effects."""
PARTS = ("verdict", "outputs", "steps", "candidates", "unexplained", "caveats", "notes")


def outcome(task: Task) -> Outcome:
    """Outcome without a diagnosis, the same in every process."""
    session = task.session
    about = {
        "key": task.key,
        "winch": session.winch,
        "session": session.session,
        "time": session.time,
        "runs": [run.path for run in session.runs],
        "profile": task.profile_hash,
    }
    estimate = about | {"kind": "model", "effect": "cell-gain", "value": len(task.key) / 7}
    return Outcome(about | {"verdict": "explained", "failure": None}, (estimate,))


def slow_outcome(task: Task) -> Outcome:
    time.sleep(0.05)
    return outcome(task)


def interrupted_outcome(task: Task) -> Outcome:
    """As a terminal does, Ctrl-C reaches the worker too; the first two tasks lose theirs."""
    os.kill(os.getpid(), signal.SIGINT)
    if task.key in {"c0", "c1"} and not (lost := Path(task.library) / task.key).exists():
        lost.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return outcome(task)


@pytest.fixture
def library(tmp_path: Path) -> Path:
    ticks = np.linspace(0.0, 1.9, 20)
    for seed, path in enumerate(("w1/2026-03-01/a.csv", "w1/2026-03-08/b.csv", "w2/c.csv")):
        angle = np.random.default_rng(seed).normal(size=20).cumsum()
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        write_run(Run("x", ticks, {"motor_angle": Channel(angle, "rad")}, {}), tmp_path / path)
    index_library(tmp_path)
    return tmp_path


def rows(library: Path, table: str) -> list[list[str]]:
    found = Partitions(library).read(table, ("runs",)).to_pylist()
    return sorted(row["runs"] for row in found)


def test_an_interruption_keeps_what_is_done_and_the_next_call_goes_on(
    library: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[str] = []

    def interrupted(task: Task) -> Outcome:
        seen.append(task.key)
        if len(seen) == 3:
            raise KeyboardInterrupt
        return outcome(task)

    monkeypatch.setattr(diagnose, "outcome_of", interrupted)
    with pytest.raises(KeyboardInterrupt):
        diagnose_library(library, "bench-spiral", jobs=1)
    assert len(rows(library, "diagnoses")) == 2
    report = diagnose_library(library, "bench-spiral", jobs=1)
    assert (report.diagnosed, report.unchanged) == (1, 2)
    assert len(seen) == 4
    assert rows(library, "estimates") == rows(library, "diagnoses")


def test_the_list_of_a_library_has_the_verdict_of_every_run(
    library: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def listed() -> list[str]:
        result = done("library", "list", library)
        return result.stdout.splitlines()

    assert not any("explained" in line for line in listed())
    monkeypatch.setattr(diagnose, "outcome_of", outcome)
    diagnose_library(library, "bench-spiral", jobs=1)
    assert len(listed()) == 3
    assert all("explained" in line for line in listed())


VISCOSITY = 0.04
"""Of the elbows, N m s/rad."""


def elbows(library: Path) -> None:
    """Two axes with viscous friction, two sessions of two runs each."""
    ticks = np.arange(0.0, 6.0, 0.01)
    for seed, (winch, day) in enumerate((w, d) for w in ("e1", "e2") for d in (1, 1, 8, 8)):
        speed = 2.0 * np.sin(2.0 * ticks) + np.cos(5.0 * ticks)
        torque = VISCOSITY * speed + np.random.default_rng(seed).normal(0.0, 1e-3, ticks.size)
        path = library / winch / f"2026-03-{day:02d}" / f"{seed}.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        angle = 1.0 - np.cos(2.0 * ticks) + 0.2 * np.sin(5.0 * ticks)
        channels = {"motor_angle": Channel(angle, "rad"), "motor_torque": Channel(torque, "N m")}
        write_run(Run("x", ticks, channels, {}), path)
    index_library(library)


def test_a_fleet_of_axes_is_diagnosed_and_its_history_fitted(tmp_path: Path) -> None:
    (tmp_path / "elbow.toml").write_text('schema = 1\nkind = "axis"\n')
    library, profile = tmp_path / "runs", tmp_path / "elbow.toml"
    elbows(library)
    report = diagnose_library(library, profile, jobs=1)
    assert (report.diagnosed, report.failures) == (4, {})
    estimates = Partitions(library).read("estimates", ("effect", "value", "kind")).to_pylist()
    named = [row["value"] for row in estimates if row["effect"] == "motor-viscous"]
    assert named == pytest.approx([VISCOSITY] * 4, rel=0.02)
    history = library_history(library, profile, effects=["motor-viscous"])
    (found,) = history.history.parameters
    assert found.common == pytest.approx(VISCOSITY, rel=0.02)
    assert history.failures == {}


def test_a_failure_is_tried_again_and_kept_with_its_reason(
    library: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried: list[str] = []

    def failing(task: Task) -> Outcome:
        if task.session.winch == "w2":
            tried.append(task.key)
            return failed(task, "RunError: no cable length")
        return outcome(task)

    monkeypatch.setattr(diagnose, "outcome_of", failing)
    report = diagnose_library(library, "bench-spiral", jobs=1)
    (reason,) = report.failures.values()
    assert (reason, report.diagnosed, len(tried)) == ("RunError: no cable length", 2, 2)
    reasons = Partitions(library).read("diagnoses", ("failure",)).to_pylist()
    assert [row["failure"] for row in reasons if row["failure"]] == [reason]
    assert diagnose_library(library, "bench-spiral", jobs=1).unchanged == 2


def test_diagnoses_of_a_deleted_run_leave_the_tables(
    library: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(diagnose, "outcome_of", outcome)
    diagnose_library(library, "bench-spiral", jobs=1)
    (library / "w1" / "2026-03-01" / "a.csv").unlink()
    index_library(library)
    left = [["w1/2026-03-08/b.csv"], ["w2/c.csv"]]
    assert rows(library, "diagnoses") == rows(library, "estimates") == left


def test_a_run_that_is_deleted_after_the_index_is_a_failure_with_its_name(
    library: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (library / "w1" / "2026-03-01" / "a.csv").unlink()

    def of_deleted(task: Task) -> Outcome:
        return outcome_of(task) if task.session.session == "2026-03-01" else outcome(task)

    monkeypatch.setattr(diagnose, "outcome_of", of_deleted)
    reason = diagnose_library(library, "bench-spiral", jobs=1).failures["w1 2026-03-01"]
    assert "a.csv" in reason


def test_a_run_that_is_being_recorded_is_diagnosed_when_it_is_whole(
    library: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(diagnose, "outcome_of", outcome)
    first, new = "w1/2026-03-01/a.csv", "w1/2026-03-01/d.csv"
    with open_writer(library / new, [("time", "s"), ("motor_angle", "rad")]) as log:
        log.append({"time": 0.0, "motor_angle": 0.0})
        log.flush()
        index_library(library)
        assert diagnose_library(library, "bench-spiral", jobs=1).diagnosed == 3
        log.append({"time": 0.1, "motor_angle": 0.1})
    index_library(library)
    report = diagnose_library(library, "bench-spiral", jobs=1)
    assert (report.diagnosed, report.unchanged) == (1, 2)
    assert rows(library, "diagnoses")[0] == [first, new]
    assert len(rows(library, "diagnoses")) == 3


def test_a_full_disk_loses_no_diagnosis_that_was_there(
    library: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(diagnose, "outcome_of", outcome)
    diagnose_library(library, "bench-spiral", jobs=1)
    shutil.copytree(library / "w1" / "2026-03-08", library / "w1" / "2026-03-15")
    index_library(library)
    before = rows(library, "diagnoses")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        with pytest.raises(FileError, match="cannot be written"):
            diagnose_library(library, "bench-spiral", jobs=1)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert rows(library, "diagnoses") == before
    report = diagnose_library(library, "bench-spiral", jobs=1)
    assert (report.diagnosed, report.unchanged) == (1, 3)


@given(st.dictionaries(st.sampled_from(PARTS[1:]), st.integers(0, 30_000)))
def test_a_stored_result_has_20_kb_and_says_what_it_lost(sizes: dict[str, int]) -> None:
    found: dict[str, Any] = {name: ["x" * sizes.get(name, 0)] for name in PARTS}
    text = stored_result(found | {"verdict": "partly", "more": "y"})
    kept = json.loads(text)
    assert len(text.encode()) <= 20_000
    assert kept["verdict"] == "partly"
    assert set(PARTS) - set(kept) == set(kept.get("dropped", ()))
    if sum(sizes.values()) < 19_000:
        assert "dropped" not in kept


def tasks(count: int, name: str) -> list[Task]:
    return [
        Task(f"{name}{n}", "", WinchSession(f"W{n}", "s", START, ()), "", "h", "p", (), None)
        for n in range(count)
    ]


@pytest.fixture(scope="module")
def workers() -> Iterator[Any]:
    """A cluster of two processes."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0"
    ) as cluster_:
        yield cluster_


@pytest.mark.slow
def test_killed_workers_and_a_second_client_lose_nothing_and_give_nothing_twice(
    workers: Any,
) -> None:
    due = tasks(40, "a")
    plain = {task.key: outcome(task) for task in due}

    def collected(kills: int) -> list[Outcome]:
        found = []
        for one in cluster_outcomes(due, scheduler=workers.scheduler_address, work=slow_outcome):
            found.append(one)
            if len(found) in range(8, 8 + 8 * kills, 8):
                worker = list(workers.workers.values())[len(found) // 8 % 2]
                if worker.process is not None and worker.process.pid is not None:
                    os.kill(worker.process.pid, signal.SIGKILL)
        return found

    with ThreadPoolExecutor(2) as clients:
        first, second = clients.map(collected, (2, 0))
    for found in (first, second):
        assert len(found) == len(due)
        assert {one.diagnosis["key"]: one for one in found} == plain


def test_the_processes_by_default_are_as_many_as_cores_and_memory_allow() -> None:
    pytest.importorskip("distributed")
    due = tasks(2, "d")
    found = list(cluster_outcomes(due, work=outcome))
    assert {one.diagnosis["key"]: one for one in found} == {t.key: outcome(t) for t in due}
    assert 1 <= cluster._processes() <= (os.cpu_count() or 1)


@pytest.mark.slow
def test_workers_of_this_computer_never_get_sigint_not_even_those_that_replace_lost_ones(
    tmp_path: Path,
) -> None:
    pytest.importorskip("distributed")
    due = [replace(task, library=str(tmp_path)) for task in tasks(6, "c")]
    found = list(cluster_outcomes(due, jobs=2, work=interrupted_outcome))
    assert {one.diagnosis["key"]: one for one in found} == {t.key: outcome(t) for t in due}
    assert {path.name for path in tmp_path.iterdir()} == {"c0", "c1"}


@pytest.mark.skipif(sys.platform == "win32", reason="no signal masks")
def test_an_interruption_while_workers_start_comes_when_they_have_started() -> None:
    pytest.importorskip("distributed")
    reached = []

    def start() -> None:
        with cluster._without_sigint():
            # To this thread: another one of the test's process may take what the process gets.
            signal.pthread_kill(threading.get_ident(), signal.SIGINT)
            reached.append(1)

    with pytest.raises(KeyboardInterrupt):
        start()
    assert reached


@pytest.mark.slow
def test_a_scheduler_without_workers_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "_TIMEOUT", 0.5)
    with (
        distributed.LocalCluster(n_workers=0, dashboard_address="127.0.0.1:0") as idle,
        pytest.raises(ConnectionLost, match="has no workers"),
    ):
        next(cluster_outcomes(tasks(1, "a"), scheduler=idle.scheduler_address, work=outcome))


@pytest.mark.slow
def test_a_cluster_that_has_lost_all_workers_ends_the_diagnosis(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "_TIMEOUT", 2.0)
    due = tasks(12, "a")
    found: list[Outcome] = []

    def collected(small: Any) -> None:
        for one in cluster_outcomes(due, scheduler=small.scheduler_address, work=slow_outcome):
            found.append(one)
            if len(found) == 3:
                small.scale(0)

    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0"
        ) as small,
        pytest.raises(ConnectionLost, match="no workers for 2 s; what was diagnosed is kept"),
    ):
        collected(small)
    assert 3 <= len(found) < len(due)


@pytest.mark.slow
def test_an_interruption_on_a_cluster_keeps_what_is_done_and_the_next_call_goes_on(
    library: Path, workers: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster, "cluster_outcomes", partial(cluster_outcomes, work=slow_outcome))
    seen: list[str] = []

    def interrupt(text: str, _: float | None) -> None:
        seen.append(text)
        if len(seen) == 2:
            raise KeyboardInterrupt

    address = workers.scheduler_address
    with pytest.raises(KeyboardInterrupt):
        diagnose_library(library, "bench-spiral", scheduler=address, progress=interrupt)
    assert len(rows(library, "diagnoses")) == 2
    report = diagnose_library(library, "bench-spiral", scheduler=address)
    assert (report.diagnosed, report.unchanged) == (1, 2)


@pytest.mark.slow
def test_processes_with_a_user_effect_give_the_rows_of_the_plain_loop_byte_for_byte(
    tmp_path: Path,
) -> None:
    pytest.importorskip("distributed")
    elbows(tmp_path / "1")
    shutil.copytree(tmp_path / "1", tmp_path / "2")
    (tmp_path / "own.py").write_text(OWN, "utf-8")
    # A profile with an effect that only the user's file knows: a worker without it cannot read it.
    profile = tmp_path / "elbow.toml"
    effect = '[[effect]]\nid = "third-harmonic"\namplitude = "5 mN m"\n'
    profile.write_text('schema = 1\nkind = "axis"\n' + effect, "utf-8")
    (reason, *_) = diagnose_library(tmp_path / "1", profile, jobs=1).failures.values()
    assert "third-harmonic" in reason
    found = []
    for jobs in (1, 2):
        folder = tmp_path / str(jobs)
        report = diagnose_library(folder, profile, effect_files=[tmp_path / "own.py"], jobs=jobs)
        assert (report.diagnosed, dict(report.failures)) == (4, {})
        tables = [Partitions(folder).read(table) for table in ("diagnoses", "estimates")]
        found.append([sorted(map(repr, table.to_pylist())) for table in tables])
    assert found[0] == found[1]
    assert all(found[0])
    assert "third-harmonic" in found[0][1][0] + found[0][0][0]
