"""How late this computer itself wakes a thread: one probe for each processor, above everything.

A probe does nothing but sleep for 1 ms, with a higher priority than the bench. What it sees
late is the kernel, the firmware, or the host of a virtual machine; no program can do better.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from contextlib import suppress

_PRIORITY, _PERIOD, _NOTED = 80, 1e-3, 1e-4


class Probes:
    """Probes on every processor, from now on."""

    def __init__(self) -> None:
        self._processes = [
            subprocess.Popen(
                [sys.executable, __file__, str(processor)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
            for processor in sorted(os.sched_getaffinity(0))
        ]

    def close(self) -> list[tuple[float, float]]:
        """End them: when each late sleep was due and when it ended, s."""
        found: list[tuple[float, float]] = []
        for process in self._processes:
            out, _ = process.communicate("end\n")
            found += [(due, woke) for due, woke in json.loads(out)]
        return sorted(found)


def _probe(processor: int) -> None:
    import gc
    import select

    os.sched_setaffinity(0, {processor})
    with suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    gc.disable()
    late: list[tuple[float, float]] = []
    count = 0
    due = time.monotonic()
    while True:
        due += _PERIOD
        pause = due - time.monotonic()
        if pause > 0:
            time.sleep(pause)
        woke = time.monotonic()
        if woke - due > _NOTED:
            late.append((due, woke))
            due = woke
        count += 1
        if count % 200 == 0 and select.select([sys.stdin], [], [], 0)[0]:
            break
    print(json.dumps(late))


if __name__ == "__main__":
    _probe(int(sys.argv[1]))
