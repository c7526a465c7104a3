"""Scheduling stalls: how long the processes of a test were runnable and were not run.

The kernel counts the time that each thread waits for a processor (proc(5), ``schedstat``, second
field); one wait is added when it ends. A sampling thread takes the differences. Time in which a
thread waits for a lock, a frame or Python's interpreter lock is not counted: it is the program's. A
standstill of the whole computer (a suspended virtual machine) shows as lateness of the sampling
thread beyond the processor time that the process used meanwhile. Where the host of a virtual
machine takes one processor away, the thread on it waits for none and the others go on: the kernel
counts that time by processor (``stat``, steal). Processes of a test are this one and those that
inherit its mark in their environment, also where they have left its process tree.
"""

from __future__ import annotations

import os
import re
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Self

import pytest

LATE_CYCLES = pytest.StashKey[Callable[[], int]]()
"""Of a test of a page: late cycles of its bench's control, where it tripped. The threads of a
browser wait for a processor at any time; their lateness excuses no failure."""

_PERIOD = 0.02
_TICKS = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 100
"""Of the kernel's counters, 1/s."""
_SEARCH = 25
"""Samples between two searches for processes."""
_MARK = "WINCHKIT_TESTS_OF"


class StallWatch:
    """Measures the largest stall between entry and exit."""

    def __init__(self, proc: Path = Path("/proc")) -> None:
        self._proc = proc
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="stall watch", daemon=True)
        self._mark = f"{_MARK}={os.getpid()}"
        os.environ[_MARK] = str(os.getpid())
        self._processes = {str(os.getpid())}
        self._before: dict[str, float] = {}
        self._stolen: dict[str, float] = {}
        self._lock = threading.Lock()
        self.largest = 0.0
        """s."""

    def __enter__(self) -> Self:
        self._before, self._stolen = self._waits(), stolen(self._proc)
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._stopping.set()
        self._thread.join()
        self.sample()

    def _run(self) -> None:
        count, before, used = 0, time.monotonic(), time.process_time()
        while not self._stopping.wait(_PERIOD):
            if count % _SEARCH == 0:
                self._search()
            count += 1
            self.sample()
            now, spent = time.monotonic(), time.process_time()
            self.largest = max(self.largest, now - before - _PERIOD - (spent - used))
            before, used = now, spent

    def _search(self) -> None:
        """Find processes that were started with this one's mark."""
        found = [item for item in self._proc.iterdir() if item.name.isdecimal()]
        present = {item.name for item in found}
        known = self._processes & present
        new = {item.name for item in found if item.name not in known and self._marked(item)}
        self._processes = known | new

    def _marked(self, process: Path) -> bool:
        try:
            return self._mark.encode() in (process / "environ").read_bytes().split(b"\0")
        except OSError:
            return False

    def sample(self) -> None:
        """Take the waits since the last sample into account."""
        with self._lock:
            found = self._waits()
            for thread, total in found.items():
                self.largest = max(self.largest, total - self._before.get(thread, total))
            self._before |= found
            taken = stolen(self._proc)
            for processor, total in taken.items():
                self.largest = max(self.largest, total - self._stolen.get(processor, total))
            self._stolen = taken

    def _waits(self) -> dict[str, float]:
        return {
            str(task): total
            for process in self._processes
            for task in _tasks(self._proc, process)
            if (total := waited(task)) is not None
        }


def stolen(proc: Path) -> dict[str, float]:
    """How long the host has taken each processor away so far, s."""
    try:
        rows = [line.split() for line in (proc / "stat").read_text().splitlines()]
    except OSError:
        return {}
    return {row[0]: int(row[8]) / _TICKS for row in rows if re.fullmatch(r"cpu\d+", row[0])}


def waited(task: Path) -> float | None:
    """How long a thread has waited for a processor so far, s; None once it has ended."""
    try:
        return int((task / "schedstat").read_text().split()[1]) * 1e-9
    except (OSError, IndexError):
        return None


def _tasks(proc: Path, process: str) -> list[Path]:
    try:
        return list((proc / process / "task").iterdir())
    except OSError:
        return []
