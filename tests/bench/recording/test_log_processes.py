"""Several ``winchkit log`` in processes of their own onto one path, beside ``sim serve``."""

from __future__ import annotations

import csv
import itertools
import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from sim_process import served_bench, start
from waiting import until

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(os.name != "posix", reason="signals of POSIX"),
]


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A simulated bench in its own process; yields its bench file."""
    with served_bench(tmp_path_factory.mktemp("served")) as path:
        yield path


def rows_of(path: Path) -> list[list[str]]:
    """By Python's own reader, without the header."""
    with path.open(newline="") as file:
        return list(csv.reader(line for line in file if not line.startswith("#")))[1:]


def until_it_logs(path: Path) -> None:
    until(lambda: path.is_file() and len(rows_of(path)) >= 10, 30.0, every=0.05)


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
