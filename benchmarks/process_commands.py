"""Kinds of ``process_faults.py`` that end a command line, its terminal or its bench process."""

from __future__ import annotations

import csv
import itertools
import json
import os
import pty
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from winchkit.bench.ownership import owner_process
from winchkit.schema.read import read_bench

COMMAND_FAULTS = {
    "SIGTERM": 143,
    "SIGHUP": 129,
    "SIGTERM to the bench process": 4,
    "SIGHUP to the bench process": 4,
    "terminal closed": 129,
}
"""Exit code of the command that moves the winch, by fault."""
_MAIN = "from winchkit.cli import main; main()"
_IN_TERMINAL = "import fcntl, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0); " + _MAIN
_DOWN = b"\x1b[B"
_REPEAT = 0.05
_PATIENCE = 30.0
_GAP = 0.25
"""Between rows of a log, s: the bench writes what has come every quarter of a second."""
_REST = 0.5
"""Of the motor, rad/s."""


class NotMoving(Exception):
    """The winch did not come to move, or stopped before the fault."""


class Commands:
    """A ``log`` and a ``jog`` of one bench; a context manager that ends what still runs."""

    def __init__(self, bench_file: Path, log: Path, fault: str, speed: float) -> None:
        self._bench_file, self._log, self._fault = bench_file, log, fault
        self._terminal: int | None = None
        log.unlink(missing_ok=True)  # the log of the case before is not this one
        self._logger = _start("log", "-b", bench_file, "-o", log, "--replace", "--json")
        self._jog: subprocess.Popen[bytes] | None = None
        self._words = ("jog", "A", "-b", bench_file)
        self._speed = f"{speed} m/s"
        self._owner: int | None = None

    def __enter__(self) -> Commands:
        return self

    def __exit__(self, *_: object) -> None:
        for process in (self._jog, self._logger):
            if process is not None and process.poll() is None:
                process.kill()
            if process is not None:
                process.communicate()
        if self._terminal is not None:
            os.close(self._terminal)
        self._until(lambda: not _runs(owner_process(read_bench(self._bench_file))))

    def move(self, moving: Callable[[], bool], moment: float) -> None:
        """Jog, and hold on for ``moment`` s once the motor turns; raises NotMoving."""
        if not self._until(lambda: self._log.is_file() or self._logger.poll() is not None):
            raise NotMoving("no log began")
        if self._fault == "terminal closed":
            self._terminal, own = pty.openpty()
            command = [sys.executable, "-c", _IN_TERMINAL, *map(str, self._words)]
            self._jog = subprocess.Popen(
                [*command, "--speed", self._speed],
                stdin=own,
                stdout=own,
                stderr=subprocess.PIPE,
                start_new_session=True,
            )
            os.close(own)
        else:
            self._jog = _start(*self._words, "--pay-out", self._speed, "--for", "60s")
        jog = self._jog
        if not self._until(lambda: self._hold() and (moving() or jog.poll() is not None)):
            raise NotMoving("the winch did not move within 30 s")
        self._owner = owner_process(read_bench(self._bench_file))
        end = time.monotonic() + moment
        while time.monotonic() < end:
            self._hold()
            time.sleep(0.01)
        if jog.poll() is not None or not moving():
            jog.kill()
            raise NotMoving((jog.communicate()[1] or b"").decode())

    def inject(self) -> None:
        """Let the fault happen."""
        assert self._jog is not None, "it moves"
        number = signal.SIGTERM if "SIGTERM" in self._fault else signal.SIGHUP
        if self._terminal is not None:
            os.close(self._terminal)
            self._terminal = None
        elif "bench process" in self._fault:
            assert self._owner is not None, "the bench process has written it"
            os.kill(self._owner, number)
        else:
            os.kill(self._jog.pid, number)

    def problems(self, lateness: float) -> Iterator[str]:
        """What the commands and the log say wrongly, once the winch is at rest."""
        assert self._jog is not None, "it has moved"
        words = (self._jog.communicate(timeout=_PATIENCE)[1] or b"").decode()
        expected = COMMAND_FAULTS[self._fault]
        if self._jog.returncode != expected:
            yield f"jog ended with {self._jog.returncode} and not {expected}: {words.strip()}"
        time.sleep(0.5)
        self._logger.send_signal(signal.SIGINT)
        out, words_of_log = self._logger.communicate(timeout=_PATIENCE)
        if "bench process" in self._fault:  # the log goes on in another file, or has ended
            yield from log_problems(self._log, None, lateness)
            return
        try:
            told = json.loads(out)["files"][str(self._log)]
        except (ValueError, KeyError):
            yield f"log told no rows: {words_of_log.decode().strip()}"
            return
        yield from log_problems(self._log, told, lateness)

    def _hold(self) -> bool:
        """Repeat the key once in its time, and read what the terminal shows; always true."""
        if self._terminal is not None:
            os.write(self._terminal, _DOWN)
            end = time.monotonic() + _REPEAT
            while (left := end - time.monotonic()) > 0:
                if select.select([self._terminal], [], [], left)[0]:
                    os.read(self._terminal, 4096)
        return True

    def _until(self, condition: Callable[[], bool]) -> bool:
        end = time.monotonic() + _PATIENCE
        while not condition():
            if time.monotonic() > end:
                return False
            time.sleep(0.005)
        return True


def log_problems(
    log: Path, told: int | None, lateness: float, *, to_rest: bool = True
) -> Iterator[str]:
    """What is wrong with a CSV log, by Python's own reader: cut, gaps, rows, the ramp missing."""
    text = log.read_text(encoding="utf-8")
    if to_rest and not text.endswith("\n"):
        yield "the log's last line is cut"
    whole = [line for line in text[: text.rfind("\n")].splitlines() if not line.startswith("#")]
    header, *rows = csv.reader(whole)
    if any(len(row) != len(header) for row in rows):
        yield "a row of the log lacks columns"
        return
    if told is not None and len(rows) != told:
        yield f"log told {told} rows, its file holds {len(rows)}"
    times = [float(row[0]) for row in rows]
    gap = max((b - a for a, b in itertools.pairwise(times)), default=float("inf"))
    if gap > _GAP + lateness:
        yield f"the log has a gap of {gap:.3f} s"
    speeds = [float(row[header.index("motor_velocity [rad/s]")]) for row in rows]
    if not any(abs(speed) > 60 for speed in speeds):
        yield "the log holds no motion"
    if to_rest and speeds and abs(speeds[-1]) > _REST:
        yield f"the log ends at {speeds[-1]:.1f} rad/s and not at rest"


def _start(*words: object) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-c", _MAIN, *map(str, words)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )


def _runs(process: int | None) -> bool:
    try:
        os.kill(process or 0, 0)
    except ProcessLookupError:
        return False
    return process is not None
