"""The progress bar on a terminal: drawn by control sequences, and apart from the results."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading

import pytest

pytestmark = pytest.mark.skipif(os.name != "posix", reason="pseudo-terminals are POSIX")

PROGRAM = """
import click, time
from winchkit.cli.core.outcome import finish
from winchkit.cli.core.terminal import progress_bar

def command():
    with progress_bar() as progress:
        for step in range(4):
            progress(f"step {step} \\x1b[2J", step / 4)
            time.sleep(0.15)
            click.echo(f"result {step}")
            click.echo(f"note {step} \\x1b[2J", err=True)

click.command()(lambda: None)
with click.Context(click.Command("x")):
    finish(command)
"""
CURSOR = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")


def on_terminal(*, results_too: bool) -> tuple[str, str]:
    """What a terminal gets, and what a pipe in place of standard output gets."""
    import pty

    master, slave = pty.openpty()
    got: list[bytes] = []

    def read() -> None:
        while True:
            try:
                data = os.read(master, 65536)
            except OSError:
                return
            if not data:
                return
            got.append(data)

    reader = threading.Thread(target=read)
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM],
        stdin=slave,
        stdout=slave if results_too else subprocess.PIPE,
        stderr=slave,
        env=os.environ | {"TERM": "xterm", "COLUMNS": "80"},
    )
    os.close(slave)
    reader.start()
    piped, _ = process.communicate(timeout=60)
    reader.join(timeout=60)
    os.close(master)
    assert process.returncode == 0
    return b"".join(got).decode(), (piped or b"").decode()


@pytest.mark.parametrize("results_too", [True, False])
def test_the_bar_is_drawn_and_texts_cannot_steer_the_terminal(results_too: bool) -> None:
    terminal, _ = on_terminal(results_too=results_too)
    assert "━" in terminal
    assert "\x1b[?25l" in terminal, "the cursor is hidden while the bar moves"
    assert "\x1b[2J" not in terminal, "a text cleared the screen"
    escaped = set(re.findall(r"\\x1b\[[0-9;?]*[A-Za-z]?", terminal))
    assert escaped <= {r"\x1b[2J"}, "the bar's own control sequences are text"


def test_results_stand_in_lines_of_their_own_above_the_bar() -> None:
    terminal, _ = on_terminal(results_too=True)
    lines = [CURSOR.sub("", line).split("\r")[-1] for line in terminal.split("\r\n")]
    for step in range(4):
        assert f"result {step}" in lines, lines


def test_a_pipe_gets_the_results_only() -> None:
    _, piped = on_terminal(results_too=False)
    assert piped == "".join(f"result {step}\n" for step in range(4))
