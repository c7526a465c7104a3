"""What a recorder costs at eight winches and 1 kHz; prints JSON, exits 1 above its aim.

``python benchmarks/recorder_cost.py --seconds 20``: CPU of the recorder's threads and of the feed
on the control thread as shares of one core, and bytes for each row (all winches of one cycle).
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import threading
import time
from pathlib import Path

from recording.synthetic import SyntheticBench
from winchkit.bench.control.snapshot import BenchSnapshot
from winchkit.bench.recording.recorder import Recorder
from winchkit.drivers.clock import MonotonicClock
from winchkit.runs.read import read_log

AIM = 0.05


def measured(path: Path, seconds: float) -> dict[str, float]:
    """Record for a time; shares of one core, and bytes."""
    clock = MonotonicClock()
    bench = SyntheticBench(clock)
    spent = 0.0
    recorder = Recorder(path, bench.sensors, clock, {"bench": "synthetic"})

    def feed(snapshot: BenchSnapshot) -> None:
        nonlocal spent
        before = time.thread_time()
        recorder.feed(snapshot)
        spent += time.thread_time() - before

    clocks = [
        time.pthread_getcpuclockid(thread.ident)
        for thread in threading.enumerate()
        if thread.name.startswith("recorder") and thread.ident is not None
    ]
    begin = clock.now()
    while clock.now() - begin < seconds:
        bench.step(feed)
    lasted = clock.now() - begin
    threads = sum(time.clock_gettime(item) for item in clocks)
    recorder.close()
    log = read_log(path)
    drives = [item for topic, item in log.samples.items() if topic.endswith("drive")] or [
        *log.samples.values()
    ]
    return {
        "seconds": lasted,
        "cycles": bench.count,
        "rows": recorder.rows,
        "cpu_feed": spent / lasted,
        "cpu_threads": threads / lasted,
        "cpu": (spent + threads) / lasted,
        "bytes": path.stat().st_size,
        "bytes_per_cycle": path.stat().st_size / bench.count,
        "bytes_per_row": path.stat().st_size / max(recorder.rows, 1),
        "samples": sum(len(item) for item in drives),
    }


def main() -> int:
    """Measure both formats."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        answer = {
            kind: measured(Path(folder) / f"cost.{kind}", given.seconds) for kind in ("mcap", "csv")
        }
    print(json.dumps({**answer, "aim": {"cpu": AIM}}))
    return int(answer["mcap"]["cpu"] > AIM)


if __name__ == "__main__":
    sys.exit(main())
