"""The thread of another process that wakes most often, e.g. that of its event loop (Linux)."""

from __future__ import annotations

import os
import time
from pathlib import Path

_WATCHED = 0.3


def busiest_thread(pid: int) -> int:
    """Native id of the thread with most voluntary context switches within 0.3 s."""

    def switches(thread: str) -> int:
        text = Path(f"/proc/{pid}/task/{thread}/status").read_text(encoding="ascii")
        return int(text.partition("\nvoluntary_ctxt_switches:")[2].split()[0])

    threads = os.listdir(f"/proc/{pid}/task")
    before = {thread: switches(thread) for thread in threads}
    time.sleep(_WATCHED)
    return int(max(threads, key=lambda thread: switches(thread) - before[thread]))
