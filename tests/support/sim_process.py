"""Commands of winchkit in processes of their own, and the simulated bench that they share."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

WINCHKIT = [sys.executable, "-c", "from winchkit.cli import main; main()"]


def start(
    *words: str | Path, stdin: int = subprocess.DEVNULL, folder: Path | None = None
) -> subprocess.Popen[str]:
    """A command that goes on beside the test."""
    return subprocess.Popen(
        [*WINCHKIT, *map(str, words)],
        cwd=folder,
        stdin=stdin,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def first_line(process: subprocess.Popen[str]) -> str:
    """What ``sim serve`` prints once its bench is served; without multicast the test is skipped."""
    assert process.stderr is not None
    if line := process.stdout.readline():
        return line
    reason = process.stderr.read()
    if "ip route add" in reason:
        pytest.skip(f"no route for multicast here: {reason}")
    pytest.fail(reason)


def free_port(group: str) -> int:
    """A port for a bus of one's own; skips the test where this machine has no multicast route."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("", 0))
        port = int(probe.getsockname()[1])
        try:
            probe.sendto(b"", (group, port))
        except OSError as error:
            pytest.skip(f"no route for multicast here: {error}")
    return port


@contextmanager
def served_bench(folder: Path) -> Iterator[Path]:
    """A simulated bench in its own process, ended like by Ctrl-C; its bench file."""
    path = folder / "bench.toml"
    with start("sim", "serve", "spiral-bench", "--bench-file", path) as process:
        first_line(process)
        yield path
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=20)
        assert process.returncode == 0
