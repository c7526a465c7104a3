"""How late the cycles of the control loop are beside load cells and a recorder.

``python benchmarks/loop_lateness.py [--seconds 10] [--threads] [--busy 20] [--beside both]``:
eight winches at 250 Hz, eight Modbus TCP cells at 25 Hz, a log by channels, with the real-time
settings that this computer permits; the drives and cells of ``soak.py`` in another process.
Without ``--beside`` four benches after each other: with neither, the cells, the recorder, both.
``--threads`` reads the cells on a thread of the bench instead of in the instrument process.
``--busy`` starts ordinary processes that compute without end. Prints the deviation of the time
between two cycles from the period, in ms. See docs/decisions/0025-instrument-process.md.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import resource
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from soak import CYCLE, WINCHES, DeviceClock, Watch, bench_file, received
from soak_devices import serve
from winchkit.bench import hardware
from winchkit.bench.bench import Bench
from winchkit.bench.open import open_bench

_BESIDE = ("neither", "cells", "recorder", "both")
_SETTLING = 1.0
"""After the opening, s."""


def deviations(bench: Bench, duration: float, log: Path | None) -> dict[str, Any]:
    """What the cycles of ``duration`` s had of lateness, and what the processes used."""
    times = [0.0] * round(2 * duration / CYCLE)
    watch, count = Watch(), 0

    def note(snapshot: Any) -> dict[str, float]:
        nonlocal count
        times[count] = snapshot.time
        count += 1
        return watch(snapshot)

    recorder = None if log is None else bench.log(log)
    time.sleep(_SETTLING)
    companion = bench._wired.companions
    used = processor_time(None), sum(map(processor_time, companion))
    overruns, begin = bench.loop.overruns, time.monotonic()
    remove = bench.on_cycle(note)
    time.sleep(duration)
    remove()
    passed = time.monotonic() - begin
    used = processor_time(None) - used[0], sum(map(processor_time, companion)) - used[1]
    trips = "; ".join(map(str, bench.snapshot.tripped))
    if recorder is not None:
        recorder.close()
    late = 1e3 * np.abs(np.diff(times[:count]) - CYCLE)
    p50, p90, p99 = (round(float(one), 3) for one in np.percentile(late, (50, 90, 99)))
    return {
        "cycles": count,
        "p50_ms": p50,
        "p90_ms": p90,
        "p99_ms": p99,
        "largest_ms": round(float(late.max()), 2),
        "missed_cycles": bench.loop.overruns - overruns,
        "share_of_core": round(used[0] / passed, 3),
        "share_of_core_beside": round(used[1] / passed, 3),
        "trips": trips,
        "realtime": [item.name for item in bench.realtime.items if item.granted],
    }


def processor_time(process: int | None) -> float:
    """Processor time of a process, by default this one, s."""
    if process is None:
        used = resource.getrusage(resource.RUSAGE_SELF)
        return used.ru_utime + used.ru_stime
    fields = Path(f"/proc/{process}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def measured(beside: str, duration: float, *, threads: bool) -> dict[str, Any]:
    """One bench, with what is ``beside`` its loop."""
    ours, theirs = multiprocessing.Pipe()
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        drives, host = str(folder / "drives"), str(folder / "host")
        arguments = (theirs, len(WINCHES), drives, host, True)
        context = multiprocessing.get_context("spawn")
        devices = context.Process(target=serve, args=arguments, daemon=True)
        devices.start()
        stack.callback(devices.join, 10.0)
        stack.callback(ours.send, "end")
        port = received(ours)
        file = bench_file(folder, port if beside in ("cells", "both") else None)
        if threads:
            stack.enter_context(patch.object(hardware, "_instrument_process", lambda *_: None))
        log = folder / "log.mcap" if beside in ("recorder", "both") else None
        begin = time.monotonic()
        with open_bench(file, DeviceClock(host, drives), realtime="try") as bench:
            opening = time.monotonic() - begin
            load = os.getloadavg()[0]
            found = deviations(bench, duration, log)
        return {"beside": beside, "threads": threads, **found} | {
            "opening_s": round(opening, 2),
            "load_average": round(load, 1),
        }


def _compute() -> None:
    while True:
        pass


def main() -> int:
    """Measure and print; exit 1 where a bench tripped."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0, help="of each measurement")
    parser.add_argument("--beside", choices=_BESIDE, help="one measurement only")
    parser.add_argument("--threads", action="store_true", help="cells on a thread of the bench")
    parser.add_argument("--busy", type=int, default=0, help="processes that compute beside it")
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    busy = [multiprocessing.Process(target=_compute, daemon=True) for _ in range(given.busy)]
    for one in busy:
        one.start()
    try:
        chosen = (given.beside,) if given.beside else _BESIDE
        found = [measured(one, given.seconds, threads=given.threads) for one in chosen]
    finally:
        for one in busy:
            one.terminate()
    for item in found:
        print(json.dumps({"schema": 1, **item}) if given.json else item)
    return 1 if any(item["trips"] for item in found) else 0


if __name__ == "__main__":
    raise SystemExit(main())
