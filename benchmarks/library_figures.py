"""Cost of a library of runs and of its diagnoses by processes, beside the plain loop.

    python benchmarks/library_figures.py throughput --json
    python benchmarks/library_figures.py tasks index query --json

``throughput``: CPU time of diagnoses of simulated sessions in the plain loop alone, in two plain
loops at once, which share memory and caches, and by two processes of a cluster, start-up left out,
and whether the rows are equal byte for byte. ``index``: ``--runs`` small runs, new and unchanged.
``tasks``: the sessions of these runs through scheduler and tables with results of 20 kB and without
diagnoses; memory of the process that has client and scheduler.
``query``: a slope per winch and effect over 10⁶ estimates. CPU times are those of a busy machine as
well; ``load`` is that of this computer before and after. About a CPU minute each.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from summaries import print_summary
from winchkit import write_run
from winchkit.catalog import find
from winchkit.fleet import diagnose_library, index_library, query_library
from winchkit.fleet.library import cluster
from winchkit.fleet.library.partitions import Partitions
from winchkit.fleet.library.sessions import winch_sessions
from winchkit.fleet.library.tables import arrow_schema
from winchkit.fleet.library.tasks import Outcome, Task, outcome_of, task_of
from winchkit.runs.run import Channel, Run
from winchkit.schema.read import read_programme, read_simbench
from winchkit.sim.bench import hiding, profiles_of, programme_path
from winchkit.sim.record import simulate

START = datetime(2026, 1, 5, tzinfo=UTC)
SESSIONS = 3
"""Of the diagnoses whose CPU time is compared."""
WINCHES = 100
ESTIMATES = 1_000_000
RESULT_BYTES = 20_000
EFFECTS = tuple(f"effect-{number}" for number in range(10))
SLOPES = (
    "SELECT winch, effect, regr_slope(value, epoch(time)) AS slope, avg(std) AS std "
    "FROM estimates GROUP BY winch, effect"
)


def throughput() -> dict[str, Any]:
    """CPU time per diagnosis of the plain loop and of a cluster."""
    with tempfile.TemporaryDirectory() as place:
        library = Path(place)
        bench = hiding(
            read_simbench(find("sim", "demo-adequate")), ["stretched cell, gain_error=0.02"]
        )
        programme = read_programme(programme_path("programme-demo"))
        for number in range(SESSIONS):
            runs = simulate(bench, profiles_of(bench), programme, seed=number, rate=25.0)
            folder = library / "A" / (START + number * timedelta(weeks=1)).date().isoformat()
            folder.mkdir(parents=True)
            for each, run in enumerate(runs):
                write_run(run, folder / f"{each}.csv")
        index_library(library)
        tables = Partitions(library)
        tasks = [task_of(tables, session, "bench-spiral") for session in winch_sessions(tables)]
        timed(tasks[0])  # imports and compiled functions
        plain = [timed(task) for task in tasks]
        # Each worker's first diagnosis has its imports: as many tasks more, whose time is left out.
        more = [replace(task, key=f"first-{task.key}") for task in tasks]
        both = cluster.cluster_outcomes([*more, *tasks], jobs=2, work=timed)
        found = {outcome.diagnosis["key"]: outcome for outcome in both}
        with ProcessPoolExecutor(2, get_context("spawn")) as pool:
            loops = list(pool.map(loop, [[more[0], *tasks], [more[1], *tasks]]))
    alone = statistics.median(one.diagnosis.pop("cpu") for one in plain)
    clustered = statistics.median(found[task.key].diagnosis.pop("cpu") for task in tasks)
    at_once = statistics.median(cpu for each in loops for cpu in each[1:])
    return {
        "diagnoses": len(tasks),
        "cpu_seconds_plain": alone,
        "cpu_seconds_two_plain": at_once,
        "cpu_seconds_cluster": clustered,
        "throughput_ratio": alone / clustered,
        "throughput_ratio_two_plain": at_once / clustered,
        "identical": [found[task.key] for task in tasks] == plain,
    }


def loop(tasks: list[Task]) -> list[float]:
    """CPU times of a plain loop; the first has the imports."""
    return [float(timed(task).diagnosis["cpu"]) for task in tasks]


def timed(task: Task) -> Outcome:
    """Diagnose a task; the CPU time of its thread beside the columns of the table.

    Heartbeats and the profiler of a worker are threads that cost by the wall time, not by the task.
    """
    begun = time.thread_time()
    outcome = outcome_of(task)
    return replace(outcome, diagnosis=outcome.diagnosis | {"cpu": time.thread_time() - begun})


def write_library(library: Path, count: int) -> None:
    """Small runs of many winches, one in a session."""
    ticks, random = np.linspace(0.0, 1.9, 20), np.random.default_rng(1)
    for number in range(count):
        day = START + timedelta(days=number // WINCHES)
        path = library / f"W{number % WINCHES:03}" / f"{day.date()}.csv"
        path.parent.mkdir(exist_ok=True)
        angle = random.normal(size=20).cumsum()
        write_run(Run("x", ticks, {"motor_angle": Channel(angle, "rad")}, {}), path)


def index(library: Path, count: int) -> dict[str, Any]:
    """Cost of the index of new and of unchanged runs."""
    write_library(library, count)
    new = spent(lambda: index_library(library))
    unchanged = spent(lambda: index_library(library))
    return {"runs": count, "index_new": new, "index_unchanged": unchanged}


def tasks(library: Path, count: int) -> dict[str, Any]:
    """Cost of client, scheduler and tables for tasks without work, and their memory."""
    memory: list[float] = []
    seen = 0

    def progress(_: str, __: float | None) -> None:
        nonlocal seen
        seen += 1
        if seen % (count // 10) == 0:
            memory.append(resident())

    plain = cluster.cluster_outcomes
    cluster.cluster_outcomes = partial(plain, work=empty)
    try:
        cost = spent(lambda: diagnose_library(library, "bench-spiral", jobs=2, progress=progress))
    finally:
        cluster.cluster_outcomes = plain
    return {
        "tasks": seen,
        "task_milliseconds": 1e3 * cost["cpu"] / seen,
        "tasks_wall": cost["wall"],
        "memory_mb": memory,
    }


def empty(task: Task) -> Outcome:
    """Rows of the largest size, without a diagnosis."""
    session = task.session
    about = {"key": task.key, "winch": session.winch, "session": session.session}
    about |= {"time": session.time, "runs": [run.path for run in session.runs]}
    about |= {"profile": task.profile_hash}
    random = np.random.default_rng(int(task.key[:8], 16))
    result = random.bytes(RESULT_BYTES // 2).hex()
    estimate = about | {"kind": "model", "effect": "cell-gain", "parameter": "gain_error"}
    row = about | {"verdict": "explained", "failure": None, "result": result}
    return Outcome(row, tuple(estimate | {"value": value} for value in random.normal(size=5)))


def query() -> dict[str, Any]:
    """Cost of a query over many estimates."""
    with tempfile.TemporaryDirectory() as place:
        library, random = Path(place), np.random.default_rng(2)
        tables, schema = Partitions(library), arrow_schema("estimates")
        ticks, run = np.linspace(0.0, 1.9, 20), library / "x.csv"
        write_run(Run("x", ticks, {"motor_angle": Channel(ticks, "rad")}, {}), run)
        index_library(library)
        each = -(-ESTIMATES // (WINCHES * 12))
        for winch in range(WINCHES):
            for month in range(1, 13):
                rows: dict[str, Any] = {
                    "winch": [f"W{winch:03}"] * each,
                    "time": [datetime(2026, month, 1 + n % 28, tzinfo=UTC) for n in range(each)],
                    "effect": [EFFECTS[n % len(EFFECTS)] for n in range(each)],
                    "value": random.normal(size=each),
                    "std": random.random(each),
                }
                columns = [
                    pa.array(rows[field.name], field.type)
                    if field.name in rows
                    else pa.nulls(each, field.type)
                    for field in schema
                ]
                place_of = tables.place(
                    "estimates", {"winch": rows["winch"][0], "time": rows["time"][0]}
                )
                place_of.parent.mkdir(parents=True, exist_ok=True)
                pq.write_table(pa.Table.from_arrays(columns, schema=schema), place_of)
        (number,) = query_library(library, "SELECT count(*) AS n FROM estimates").to_pylist()
        costs = [spent(lambda: query_library(library, SLOPES)) for _ in range(3)]
        return {"estimates": number["n"], "query": min(costs, key=lambda cost: cost["wall"])}


def spent(work: Callable[[], object]) -> dict[str, float]:
    """CPU time of this process and wall time, s."""
    cpu, wall = time.process_time(), time.monotonic()
    work()
    return {"cpu": time.process_time() - cpu, "wall": time.monotonic() - wall}


def resident() -> float:
    """Resident memory of this process, MB."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


PARTS = ("throughput", "index", "tasks", "query")


def main() -> int:
    """Measure the parts that the arguments name."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("parts", nargs="+", choices=PARTS)
    parser.add_argument("--runs", type=int, default=10_000, help="of index and tasks")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    found: dict[str, Any] = {"load": [os.getloadavg()[0]]}
    if "throughput" in args.parts:
        found |= throughput()
    if {"index", "tasks"} & set(args.parts):
        with tempfile.TemporaryDirectory() as place:
            found |= index(Path(place), args.runs)
            if "tasks" in args.parts:
                found |= tasks(Path(place), args.runs)
    if "query" in args.parts:
        found |= query()
    found["load"].append(os.getloadavg()[0])
    print_summary(found, as_json=args.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
