"""Real-time settings: what the kernel says of the process, with permission and without."""

from __future__ import annotations

import gc
import sys
import textwrap
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from command_line import own_process
from winchkit import catalog, open_bench
from winchkit.bench.control.computer import _limit, survey
from winchkit.bench.control.realtime import RestCollector, acquire
from winchkit.bench.control.snapshot import BenchSnapshot, Phase, WinchSnapshot
from winchkit.schema.read import read_simbench
from winchkit.sim.live.bench import LiveBench

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="Linux scheduling")

PERMITTED = next(item for item in survey() if item.name == "scheduling").granted
_FIFO = 1


def scheduling(thread: int) -> tuple[int, int]:
    """Policy and priority as proc(5) shows them: fields 41 and 40 of `stat`."""
    stat = Path(f"/proc/self/task/{thread}/stat").read_text().rpartition(")")[2].split()
    return int(stat[38]), int(stat[37])


def locked() -> int:
    """Locked memory of this process, kB."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return int(next(line for line in lines if line.startswith("VmLck")).split()[1])


@contextmanager
def waiting_thread() -> Iterator[int]:
    """A thread that waits, by its native id."""
    over = threading.Event()
    thread = threading.Thread(target=over.wait)
    thread.start()
    try:
        assert thread.native_id is not None
        yield thread.native_id
    finally:
        over.set()
        thread.join()


@pytest.mark.skipif(not PERMITTED, reason="SCHED_FIFO is not permitted here")
def test_the_urgent_thread_is_above_every_other_of_the_process_until_closed() -> None:
    main = threading.main_thread().native_id or 0
    with waiting_thread() as urgent, waiting_thread() as other:
        granted = acquire("try", [urgent])
        try:
            assert granted.scheduled
            assert scheduling(urgent) == (_FIFO, 50)
            assert scheduling(other) == scheduling(main) == (_FIFO, 10)
            with waiting_thread() as late:
                assert scheduling(late) == (_FIFO, 10)
                granted.cover([urgent, late])
                assert scheduling(late) == (_FIFO, 50)
        finally:
            granted.close()
        granted.close()
        assert scheduling(urgent) == scheduling(other) == scheduling(main) == (0, 0)


@pytest.mark.skipif(not PERMITTED, reason="SCHED_FIFO is not permitted here")
def test_a_priority_that_somebody_else_has_set_is_kept() -> None:
    import os

    with waiting_thread() as chosen:
        os.sched_setscheduler(chosen, os.SCHED_RR, os.sched_param(80))
        granted = acquire("try", [chosen])
        assert scheduling(chosen) == (os.SCHED_RR, 80)
        granted.close()
        assert scheduling(chosen) == (os.SCHED_RR, 80)


@pytest.fixture
def unfrozen() -> Iterator[None]:
    """The collector as a program has it: tests/conftest.py has frozen what was collected."""
    gc.unfreeze()
    yield
    gc.freeze()


@pytest.mark.usefixtures("unfrozen")
def test_collector_and_interpreter_lock_are_given_back() -> None:
    threshold, interval = gc.get_threshold(), sys.getswitchinterval()
    before = locked()
    granted = acquire("try", [])
    try:
        assert gc.get_freeze_count() > 0
        assert gc.get_threshold()[1:] > (10**6, 10**6)
        assert sys.getswitchinterval() < 1e-3
        memory = next(item for item in granted.items if item.name == "memory")
        assert (locked() > before) == memory.granted
    finally:
        granted.close()
    assert (gc.get_threshold(), sys.getswitchinterval()) == (threshold, interval)
    assert gc.get_freeze_count() == 0
    assert locked() == before


@pytest.mark.usefixtures("unfrozen")
def test_without_a_request_the_objects_are_frozen_and_nothing_else_changes() -> None:
    before = gc.get_threshold(), sys.getswitchinterval(), locked()
    nothing = acquire(False, [threading.get_native_id()])
    try:
        assert gc.get_freeze_count() > 0
        assert (gc.get_threshold(), sys.getswitchinterval(), locked()) == before
        assert not nothing.granted
        assert "realtime=" in str(nothing.refused[0])
    finally:
        nothing.close()
    assert gc.get_freeze_count() == 0


@pytest.mark.usefixtures("unfrozen")
def test_in_simulated_time_nothing_changes() -> None:
    acquire(False, [], simulated=True).close()
    assert gc.get_freeze_count() == 0


@pytest.mark.realtime
@pytest.mark.skipif(not PERMITTED, reason="SCHED_FIFO is not permitted here")
def test_an_open_bench_has_its_threads_prioritised_also_after_a_bus_was_opened_again() -> None:
    sim = read_simbench(catalog.find("sim", "spiral-bench"))
    winch = replace(sim.bench.winch["A"], cell=None, length=None, temperature=None)
    buses = {"can": replace(sim.bench.bus["can"], heartbeat=0.2)}
    sim = replace(sim, bench=replace(sim.bench, winch={"A": winch}, bus=buses))
    main = threading.main_thread().native_id or 0
    with LiveBench(sim, seed=1) as live:
        with open_bench(live.bench_spec, realtime="try") as bench:
            bus = bench._wired.buses["can"]
            first = bus.thread_id
            assert scheduling(bench.loop.thread_id) == scheduling(first) == (_FIFO, 50)
            assert scheduling(main) == (_FIFO, 10)
            assert bench.realtime.scheduled
            bus.reopen()
            bench.reset()
            assert bus.thread_id != first
            assert scheduling(bus.thread_id) == (_FIFO, 50)
        assert scheduling(main) == (0, 0)
        with open_bench(live.bench_spec) as bench:
            assert scheduling(bench.loop.thread_id) == (0, 0)
            assert not bench.realtime.granted


_WITHOUT_PERMISSION = """
    import gc, json, os, resource, sys, threading
    from winchkit.bench.control.computer import survey
    from winchkit.bench.control.realtime import acquire
    from winchkit.errors import NotPermitted

    resource.setrlimit(resource.RLIMIT_RTPRIO, (0, 0))
    resource.setrlimit(resource.RLIMIT_MEMLOCK, (8 << 20, 8 << 20))
    if os.getuid() == 0:
        os.setresuid(65534, 65534, 65534)
    before = gc.get_threshold(), sys.getswitchinterval()
    surveyed = {item.name: item for item in survey()}
    tried = acquire("try", [threading.get_native_id()])
    refused = {item.name: str(item) for item in tried.refused}
    policy = os.sched_getscheduler(0)
    tried.close()
    try:
        acquire(True, [])
        demanded = ""
    except NotPermitted as error:
        demanded = str(error)
    after = gc.get_threshold(), sys.getswitchinterval()
    print(json.dumps([
        refused, policy, demanded, before == after,
        {name: item.granted for name, item in surveyed.items()},
    ]))
"""


def test_a_refusal_names_the_setting_that_permits_it_and_changes_nothing() -> None:
    import json

    script = textwrap.dedent(_WITHOUT_PERMISSION)
    run = own_process(sys.executable, "-c", script)
    refused, policy, demanded, undone, surveyed = json.loads(run.stdout)
    assert set(refused) == {"scheduling", "memory"}
    assert "rtprio 50" in refused["scheduling"]
    assert "CAP_SYS_NICE" in refused["scheduling"]
    assert "memlock unlimited" in refused["memory"]
    assert "8 MB" in refused["memory"]
    assert policy == 0
    assert "rtprio" in demanded
    assert "memlock" in demanded
    assert undone
    assert not surveyed["scheduling"]
    assert not surveyed["memory"]


def picture(time: float, phase: Phase) -> BenchSnapshot:
    nan = float("nan")
    winch = WinchSnapshot(phase, "switched on", time, nan, nan, nan, nan, nan)
    return BenchSnapshot(time, round(time / 0.004), {"A": winch})


def test_old_objects_are_collected_at_rest_only() -> None:
    collected: list[float] = []
    now = [0.0]
    collector = RestCollector(10.0, lambda: collected.append(now[0]))
    phases = {0.0: Phase.DISABLED, 20.0: Phase.MOVING, 50.0: Phase.STOPPING, 51.0: Phase.DISABLED}
    phase = Phase.DISABLED
    for cycle in range(7000):
        now[0] = cycle / 100
        phase = phases.get(now[0], phase)
        collector(picture(now[0], phase))
    assert collected == [0.01, 10.01, 51.01, 61.01]


@pytest.mark.parametrize(
    ("runtime", "granted", "words"),
    [
        (950_000, True, "stand still for 50 ms"),
        (500_000, False, "500000 of 1000000 us"),
        (0, False, "0 of 1000000 us"),
        (-1, True, "no limit"),
        (1_000_000, True, "no limit"),
    ],
)
def test_the_kernels_limit_of_real_time_threads_is_reported(
    runtime: int, granted: bool, words: str
) -> None:
    item = _limit(runtime, 1_000_000)
    assert item.granted is granted
    assert words in item.detail
    assert bool(item.remedy) is not granted
