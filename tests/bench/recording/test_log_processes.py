"""Several ``winchkit log`` in processes of their own onto one path, beside ``sim serve``."""

from __future__ import annotations

import csv
import itertools
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(os.name != "posix", reason="signals of POSIX"),
]

WINCHKIT = [sys.executable, "-c", "from winchkit.cli import main; main()"]


def start(*arguments: str | Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [*WINCHKIT, *map(str, arguments)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A simulated bench in its own process; yields its bench file."""
    path = tmp_path_factory.mktemp("served") / "bench.toml"
    with start("sim", "serve", "spiral-bench", "--bench-file", path) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        if not process.stdout.readline():
            reason = process.stderr.read()
            if "ip route add" in reason:
                pytest.skip(f"no route for multicast here: {reason}")
            pytest.fail(reason)
        yield path
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=20)


def rows_of(path: Path) -> list[list[str]]:
    """By Python's own reader, without the header."""
    with path.open(newline="") as file:
        return list(csv.reader(line for line in file if not line.startswith("#")))[1:]


def until_it_logs(path: Path) -> None:
    deadline = time.monotonic() + 30
    while not path.is_file() or len(rows_of(path)) < 10:
        assert time.monotonic() < deadline, "no log began"
        time.sleep(0.05)


def test_a_second_log_onto_one_path_is_refused_whatever_it_calls_it(
    served: Path, tmp_path: Path
) -> None:
    path, link = tmp_path / "lift.csv", tmp_path / "link.csv"
    link.symlink_to(path)
    refused = []
    first = start("log", "-b", served, "-o", path)
    try:
        until_it_logs(path)
        for words in ((path,), (link,), (path, "--rotate", "1s")):
            with start("log", "-b", served, "--for", "1s", "--replace", "-o", *words) as second:
                out, told = second.communicate()
            refused.append((second.returncode, out, "another log is being written to it" in told))
    finally:
        first.send_signal(signal.SIGINT)
        out, told = first.communicate()
    assert refused == [(2, "", True)] * 3
    assert first.returncode == 0, told
    rows = rows_of(path)
    assert out == f"{path}: {len(rows)} rows\n"
    times = [float(row[0]) for row in rows]
    assert all(later > earlier for earlier, later in itertools.pairwise(times))


def test_of_logs_that_begin_at_once_one_is_kept(served: Path, tmp_path: Path) -> None:
    """Whoever says that it saved so many rows has saved them."""
    path = tmp_path / "lift.csv"
    processes = [
        start("log", "-b", served, "-o", path, "--replace", "--for", "4s") for _ in range(3)
    ]
    ended = [process.communicate(timeout=90) for process in processes]
    codes = [process.returncode for process in processes]
    assert codes.count(0) == 1, ended
    winner = codes.index(0)
    assert ended[winner][0] == f"{path}: {len(rows_of(path))} rows\n"
