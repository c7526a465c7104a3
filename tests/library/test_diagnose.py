"""Diagnoses of a library: what is kept, repeated and removed; workers killed, two clients."""

from __future__ import annotations

import json
import os
import signal
import time
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit import diagnose_library, index_library, write_run
from winchkit.library import diagnose
from winchkit.library.cluster import cluster_outcomes
from winchkit.library.partitions import Partitions
from winchkit.library.sessions import WinchSession
from winchkit.library.tasks import Outcome, Task, failed, stored_result
from winchkit.runs.run import Channel, Run

pytest.importorskip("pyarrow")
START = datetime(2026, 1, 5, tzinfo=UTC)
PARTS = (
    "verdict", "outputs", "steps", "candidates", "unexplained", "caveats", "closest", "notes",
)  # fmt: skip


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


@pytest.mark.slow
def test_killed_workers_and_a_second_client_lose_nothing_and_give_nothing_twice() -> None:
    distributed = pytest.importorskip("distributed")
    due = tasks(40, "a")
    plain = {task.key: outcome(task) for task in due}
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        address = cluster.scheduler_address

        def collected(kills: int) -> list[Outcome]:
            found = []
            for one in cluster_outcomes(due, scheduler=address, work=slow_outcome):
                found.append(one)
                if len(found) in range(8, 8 + 8 * kills, 8):
                    worker = list(cluster.workers.values())[len(found) // 8 % 2]
                    if worker.process is not None and worker.process.pid is not None:
                        os.kill(worker.process.pid, signal.SIGKILL)
            return found

        with ThreadPoolExecutor(2) as clients:
            first, second = clients.map(collected, (2, 0))
    for found in (first, second):
        assert len(found) == len(due)
        assert {one.diagnosis["key"]: one for one in found} == plain
