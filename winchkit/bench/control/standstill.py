"""Cause of a standstill of the control thread, from the kernel's counters.

A late cycle has one of few causes, and each has another remedy: other programs had the processor,
another thread of this process computed (in Python only one does at a time), or pages of the
program were read from disk. Linux counts each of them: getrusage(2), ``schedstat`` of proc(5).
What the host of a virtual machine takes is counted in ``stat``, which takes longer to read (0.1
ms) than a control loop may.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from pathlib import Path

_PERIOD = 0.1
"""Period of the readings that a standstill is compared with, s: one takes 15 us."""
_UNKNOWN = (
    "other programs, the host of a virtual machine, a suspended process, or a clock that was set"
)


@dataclass(frozen=True, slots=True)
class _Counters:
    """Since the start, s; NaN where the kernel does not count it."""

    time: float
    thread: float
    """Processor time of the control thread."""
    process: float
    """Processor time of all threads of the process."""
    waited: float
    """The control thread was runnable, and another program had the processor."""
    pages: int
    """Pages that the process had to wait for until they were read from disk."""


class StandstillCause:
    """Compares the counters after a standstill with those before; for the control thread only."""

    def __init__(self, *, counted: bool = True, proc: Path = Path("/proc")) -> None:
        """``counted`` is false in simulated time; ``proc`` is the folder of proc(5)."""
        self._counted = counted
        self._schedstat = str(proc / "thread-self" / "schedstat")
        self._before: _Counters | None = None

    def note(self, now: float) -> None:
        """Read the counters where the last reading is old; ``now`` in s, of a monotonic clock."""
        if not self._counted:
            return
        if self._before is None or not 0.0 <= now - self._before.time < _PERIOD:
            self._before = self._read(now)

    def explain(self, now: float, gap: float, *, between: float) -> str:
        """Cause of a standstill of ``gap`` s, ``between`` s after the end of a cycle, in words."""
        if self._before is None or gap <= 0.0:
            return _UNKNOWN
        before, after = self._before, self._read(now)
        self._before = after
        thread = after.thread - before.thread
        pages = after.pages - before.pages
        found = {
            "other programs had the processor": after.waited - before.waited,
            "the control thread computed": thread,
            "other threads of this process computed": after.process - before.process - thread,
        }
        causes = [f"{words} for {time:.2f} s" for words, time in found.items() if time >= gap / 2]
        if not causes and pages > 0:
            causes = [f"{pages} pages of this program were read from disk"]
        where = "between two cycles" if between > gap / 2 else "within a cycle"
        return f"{', '.join(causes) or _UNKNOWN} ({where})"

    def _read(self, now: float) -> _Counters:
        return _Counters(
            now,
            time.thread_time(),
            time.process_time(),
            self._waited(),
            _pages_read(),
        )

    def _waited(self) -> float:
        try:
            with open(self._schedstat, "rb", buffering=0) as file:
                return int(file.read().split()[1]) * 1e-9
        except (OSError, ValueError, IndexError):
            return math.nan


def _pages_read() -> int:
    """Major page faults of the process so far; 0 where the system does not count them."""
    try:
        import resource
    except ImportError:
        return 0
    return resource.getrusage(resource.RUSAGE_SELF).ru_majflt
