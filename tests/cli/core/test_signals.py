"""SIGTERM and SIGHUP end a command like Ctrl-C, each with its own exit code."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import pytest

from command_line import own_process

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")

PROGRAM = """
import os, signal, sys, time
from winchkit.cli.core.outcome import finish

def command():
    try:
        os.kill(os.getpid(), {number})
        time.sleep(10)
    finally:
        for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
            os.kill(os.getpid(), number)  # a repetition must not break the stop
        time.sleep(0.05)
        print("stopped", flush=True)

finish(command)
"""


def run(program: str, **options: object) -> subprocess.CompletedProcess[str]:
    return own_process(sys.executable, "-c", program, code=None, **options)


@pytest.mark.parametrize(
    ("number", "code", "words"),
    [
        (signal.SIGINT, 130, "winchkit: interrupted\n"),
        (signal.SIGTERM, 143, "winchkit: ended by SIGTERM\n"),
        (signal.SIGHUP, 129, "winchkit: ended by SIGHUP\n"),
    ],
)
def test_a_signal_ends_a_command_after_its_stop(number: int, code: int, words: str) -> None:
    done = run(PROGRAM.format(number=int(number)))
    assert done.returncode == code, done.stderr
    assert done.stdout == "stopped\n"
    assert done.stderr == words


def test_a_signal_that_is_ignored_from_outside_stays_ignored() -> None:
    """As under nohup."""
    ignoring = "import signal; signal.signal(signal.SIGHUP, signal.SIG_IGN)\n"
    program = PROGRAM.format(number=int(signal.SIGHUP)).replace("sleep(10)", "sleep(0.1)")
    program = program.replace("(signal.SIGTERM, signal.SIGHUP, signal.SIGINT)", "()")
    done = run(ignoring + program)
    assert (done.returncode, done.stdout) == (0, "stopped\n"), done.stderr


@pytest.mark.slow
def test_a_library_installs_no_handler() -> None:
    done = run(
        "import signal, winchkit\n"
        "from winchkit.bench.remote.session import attach, at_station\n"
        "from winchkit.bench.open import open_bench\n"
        "assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL\n"
        "assert signal.getsignal(signal.SIGHUP) is signal.SIG_DFL\n"
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_what_computes_in_threads_ends_with_the_code_of_its_signal(number: int, code: int) -> None:
    done = run(
        "import os, signal, time\n"
        f"signal.signal({int(number)}, signal.default_int_handler if {int(number)} == 2 else "
        "signal.SIG_DFL)\n"
        "from winchkit.bench.remote.interruption import interrupted_by_signals\n"
        "from winchkit.cli.core.outcome import threads_abandoned\n"
        "with interrupted_by_signals(), threads_abandoned():\n"
        f"    os.kill(os.getpid(), {int(number)})\n"
        "    time.sleep(10)\n"
    )
    assert done.returncode == code, done.stderr


def test_a_terminal_that_was_closed_without_a_signal_ends_a_command_in_one_sentence() -> None:
    """As of a question under ``nohup``, whose prompt has no terminal any more."""
    done = run(
        "import os, pty\n"
        "from winchkit.cli.core.outcome import finish\n"
        "def command():\n"
        "    master, terminal = pty.openpty()\n"
        "    os.dup2(terminal, 1)\n"
        "    os.close(terminal)\n"
        "    os.close(master)\n"
        "    os.write(1, b'? ')\n"
        "finish(command)\n"
    )
    assert (done.returncode, done.stderr) == (129, "winchkit: the terminal was closed\n")
