"""What a program reads from pipes: ``sim serve``, ``log`` and ``monitor`` with ``--json``."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from sim_process import first_line, start
from waiting import until
from winchkit.runs import read_run

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(os.name != "posix", reason="signals of POSIX"),
]

PIPE = subprocess.PIPE


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A bench that is used as soon as the line is there, without any waiting."""
    path = tmp_path_factory.mktemp("served") / "bench.toml"
    words = ("sim", "serve", "spiral-bench", "--json", "--bench-file", path)
    with start(*words, stdin=PIPE) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert json.loads(first_line(process)) == {"schema": 1, "bench": str(path), "ready": True}
        yield path
        process.stdin.write("status\nnonsense\n")
        process.stdin.flush()
        reply = json.loads(process.stdout.readline())
        assert reply["line"] == "status"
        assert "A: " in reply["reply"]
        process.send_signal(signal.SIGTERM)
        out, _ = process.communicate(timeout=30)
        assert process.returncode == 0
        assert out == "", "nothing but JSON on stdout"


def test_monitor_has_the_cable_length_of_every_winch(served: Path) -> None:
    with start("monitor", "-b", served, "--json", "--for", "2s") as process:
        out, told = process.communicate(timeout=60)
    assert process.returncode == 0, told
    pictures = [json.loads(line) for line in out.splitlines()]
    assert pictures
    for picture in pictures:
        assert set(picture["winch"]) == {"A"}
        assert math.isfinite(picture["winch"]["A"]["cable_length"])
        assert {"cable_speed", "phase", "tension"} <= set(picture["winch"]["A"])


def test_log_ends_with_its_rows(served: Path, tmp_path: Path) -> None:
    path = tmp_path / "lift.csv"
    with start("log", "-b", served, "-o", path, "--for", "2s", "--json") as process:
        out, told = process.communicate(timeout=60)
    assert process.returncode == 0, told
    found = json.loads(out)
    assert list(found)[-1] == "rows"
    assert found["rows"] == len(read_run(path)) > 10
    assert found["output"] == str(path)


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 0), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_a_log_that_is_interrupted_ends_with_its_rows_too(
    served: Path, tmp_path: Path, number: int, code: int
) -> None:
    path = tmp_path / "lift.csv"
    with start("log", "-b", served, "-o", path, "--json") as process:
        until(lambda: path.is_file() and path.read_bytes().count(b"\n") >= 60, within=40.0)
        process.send_signal(number)
        out, told = process.communicate(timeout=60)
    assert process.returncode == code, told
    assert json.loads(out)["rows"] == len(read_run(path))


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 0), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_monitor_ends_at_a_signal(served: Path, number: int, code: int) -> None:
    """Ctrl-C is its usual end."""
    with start("monitor", "-b", served, "--json") as process:
        assert json.loads(process.stdout.readline())["winch"]
        process.send_signal(number)
        process.communicate(timeout=60)
    assert process.returncode == code


def test_a_log_that_fails_says_how_many_rows_are_saved(served: Path, tmp_path: Path) -> None:
    path = tmp_path / "lift.csv"
    with start("log", "-b", served, "-o", path, "--json") as process:
        until(lambda: path.is_file() and path.read_bytes().count(b"\n") >= 60, within=40.0)
        path.unlink()
        out, told = process.communicate(timeout=60)
    assert process.returncode == 3
    assert "was removed by another program" in told
    found = json.loads(out)
    assert "was removed by another program" in found["problem"]
    assert found["rows"] > 10
