"""A bench whose load cell is read by the instrument process: the same readings, and its trips."""

from __future__ import annotations

import ctypes
import errno
import gc
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from busiest_thread import busiest_thread
from waiting import until
from winchkit import catalog, open_bench
from winchkit.bench.bench import Bench
from winchkit.bench.control import realtime
from winchkit.errors import LimitTripped
from winchkit.schema.read import read_simbench
from winchkit.sim.live.bench import LiveBench

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(sys.platform != "linux", reason="signals and /proc"),
]
WEIGHT = 10 * 9.80665


@pytest.fixture
def live() -> Iterator[LiveBench]:
    """A heartbeat of 200 ms: the simulated drives are threads of this process.

    The objects of the tests are frozen: to collect them takes longer than two heartbeats.
    """
    declared = read_simbench(catalog.find("sim", "spiral-bench"))
    buses = {**declared.bench.bus, "can": replace(declared.bench.bus["can"], heartbeat=0.2)}
    declared = replace(declared, bench=replace(declared.bench, bus=buses))
    gc.collect()
    gc.freeze()
    with LiveBench(declared, seed=3) as running:
        yield running
    gc.unfreeze()


@pytest.fixture
def bench(live: LiveBench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    """Without the priorities, which would put the simulated drives below the loop."""

    def refused(*_: object) -> None:
        raise PermissionError(errno.EPERM, "refused by the test")

    monkeypatch.setattr(realtime, "_prioritise", refused)
    with open_bench(live.write_bench_file(tmp_path / "bench.toml"), realtime="try") as opened:
        yield opened


def process_of(bench: Bench) -> int:
    (pid,) = bench._wired.companions
    return pid


def test_without_real_time_the_lines_stay_in_the_bench(live: LiveBench) -> None:
    with open_bench(live.bench_spec) as bench:
        assert bench._wired.companions == ()
        assert bench.winch["A"].tension == pytest.approx(WEIGHT, abs=8)


def test_the_real_time_settings_say_who_reads_the_instruments(bench: Bench) -> None:
    """Without a priority other programs delay its readings; the remedy is named."""
    (item,) = (item for item in bench.realtime.items if item.name == "instruments")
    assert not item.granted
    assert "instrument process" in item.detail
    assert "rtprio" in item.remedy or "cpu.rt_runtime_us" in item.remedy


def test_readings_tares_and_facts_of_the_process(bench: Bench, tmp_path: Path) -> None:
    winch, cells = bench.winch["A"], bench.cells
    assert winch.tension == pytest.approx(WEIGHT, abs=8)
    assert abs(winch.tare()) < 8, "the device's own tare, confirmed by its status"
    assert cells.sensors["A.cell"].tared
    assert cells.identify("A.cell")["serial number"] == 4711
    rate = cells.line_rate("A.cell")
    assert rate is not None
    assert rate > 0
    cells.store("A.cell", "store")
    with bench.log(tmp_path / "log.csv") as recorder:
        winch.move_by(wind_in=0.1)
        counters = recorder.counters()
    assert counters["A.cell"]["readings"] > 20
    assert counters["A.cell"]["drops"] == 0
    pid = process_of(bench)
    bench.close()
    until(lambda: not Path(f"/proc/{pid}").exists())


def kill(pid: int) -> Callable[[], None]:
    os.kill(pid, signal.SIGKILL)
    return lambda: None


def stop(pid: int) -> Callable[[], None]:
    os.kill(pid, signal.SIGSTOP)
    return lambda: os.kill(pid, signal.SIGCONT)


def hang(pid: int) -> Callable[[], None]:
    """Stop the thread of its lines alone, by ptrace(2)."""
    libc = ctypes.CDLL(None, use_errno=True)
    thread = busiest_thread(pid)
    if libc.ptrace(16, thread, None, None):  # PTRACE_ATTACH
        pytest.skip(f"ptrace is not permitted here: {os.strerror(ctypes.get_errno())}")

    def go_on() -> None:
        os.waitpid(thread, 0x40000000)  # __WALL
        libc.ptrace(17, thread, None, None)  # PTRACE_DETACH

    return go_on


@pytest.mark.parametrize(
    ("fault", "words", "returns"),
    [
        (kill, "has ended (signal SIGKILL)", False),
        (stop, "does not respond", True),
        (hang, "does not respond", True),
    ],
)
def test_its_end_in_motion_trips_the_winch_with_the_cause(
    bench: Bench, fault: Callable[[int], Callable[[], None]], words: str, returns: bool
) -> None:
    winch, pid = bench.winch["A"], process_of(bench)
    cell = winch.sensors["cell"]
    winch.move_by(wind_in=1.5, speed=0.1, wait=False)
    until(lambda: winch.snapshot.cable_speed < -0.05)
    go_on = fault(pid)
    try:
        until(lambda: bool(bench.snapshot.tripped))
        (trip,) = bench.snapshot.tripped
        assert (trip.kind, trip.winch) == ("cell stale", "A")
        assert f"the instrument process (number {pid}) {words}" in trip.message
        # A cycle is 4 ms; the test itself looks every 2 ms.
        assert time.monotonic() - cell.latest.t_receive < cell.max_age + 0.05
        until(lambda: not winch.moving and abs(winch.snapshot.cable_speed) < 0.005)
        with pytest.raises(LimitTripped):
            winch.move_by(wind_in=0.1)
    finally:
        go_on()
    if returns:
        until(lambda: cell.problem is None)
        time.sleep(0.1)
        bench.reset()
        winch.move_by(wind_in=0.05)
    else:
        with pytest.raises(LimitTripped, match="has ended"):
            bench.reset()
