"""Waiting for what another thread or process is bound to do soon."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import Any


def until(
    condition: Callable[[], bool],
    within: float = 15.0,
    what: str = "it did not come to that",
    every: float = 0.005,
) -> float:
    """Look for a condition each ``every`` s until it is true; the time that it took, s."""
    begin = time.monotonic()
    while not condition():
        assert time.monotonic() - begin < within, what
        time.sleep(every)
    return time.monotonic() - begin


def run_together(threads: Iterable[Any]) -> None:
    """Start threads, of Python or of a simulated clock, and wait until all have ended."""
    started = [*threads]
    for thread in started:
        thread.start()
    for thread in started:
        thread.join()
