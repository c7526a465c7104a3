"""The instrument process ends, stands still or hangs; and it never outlives its bench."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from busiest_thread import busiest_thread
from modbus_peer import Peer
from waiting import until
from winchkit import catalog
from winchkit.drivers.clock import MonotonicClock
from winchkit.drivers.instrument_process.process import (
    InstrumentProcess,
    LineInstrument,
    ProcessLineSpec,
    SeparateInstrument,
    line_of,
)
from winchkit.drivers.slow import SlowDevices
from winchkit.errors import ConnectionLost
from winchkit.schema.bench import BusSpec
from winchkit.schema.read import read_device

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(sys.platform != "linux", reason="signals and /proc"),
]
CLOCK = MonotonicClock()
_ATTACH, _DETACH = 16, 17
"""Requests of ptrace(2)."""


def line_at(port: int) -> ProcessLineSpec:
    device = read_device(catalog.find("devices", "laumas-tlb"))
    bus = BusSpec("modbus-tcp", host="127.0.0.1", port=port, timeout=0.1)
    return ProcessLineSpec("cells", bus, (LineInstrument("cell of winch A", device, 1, 50.0),))


class Bench:
    """What a bench has of the process: one cell."""

    def __init__(self, port: int) -> None:
        self.process = InstrumentProcess(CLOCK)
        spec = line_at(port)
        line = self.process.adopt(spec, line_of(spec, CLOCK))
        self.process.start()
        self.process.await_start()
        self.slow = SlowDevices([line])
        cell = line.sensors[0]
        assert isinstance(cell, SeparateInstrument)
        self.cell: SeparateInstrument = cell
        until(lambda: self.cell.latest is not None)

    @property
    def pid(self) -> int:
        assert self.process.pid is not None
        return self.process.pid

    @property
    def age(self) -> float:
        return CLOCK.now() - self.cell.latest.t_receive


@pytest.fixture
def bench() -> Iterator[Bench]:
    with Peer() as peer:
        peer.registers |= {6: 1 << 11, 8: 1000, 10: 1000}
        opened = Bench(peer.port)
        yield opened
        opened.slow.close()
        opened.process.close()
        assert not runs(opened.pid) if opened.process.pid else True


def runs(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(") ")[2][0]
    except OSError:
        return False
    return state != "Z"


def test_a_killed_process_is_named_at_once(bench: Bench) -> None:
    assert bench.cell.problem is None
    os.kill(bench.pid, signal.SIGKILL)
    assert until(lambda: bench.cell.problem is not None) < 0.1
    assert f"the instrument process (number {bench.pid}) has ended (signal SIGKILL)" in str(
        bench.cell.problem
    )
    begin = time.monotonic()
    with pytest.raises(ConnectionLost, match="has ended"):
        bench.slow.command(bench.cell, "zero")
    with pytest.raises(ConnectionLost, match="has ended"):
        bench.slow.identify(bench.cell)
    assert time.monotonic() - begin < 1.0
    count = bench.cell.counters.readings
    time.sleep(0.2)
    assert bench.cell.counters.readings == count


def test_a_stopped_process_is_named_before_its_readings_are_stale(bench: Bench) -> None:
    os.kill(bench.pid, signal.SIGSTOP)
    try:
        until(lambda: bench.cell.problem is not None)
        assert bench.age < bench.cell.max_age
        assert f"(number {bench.pid}) does not respond" in str(bench.cell.problem)
        begin = time.monotonic()
        with pytest.raises(ConnectionLost, match="does not respond"):
            bench.slow.command(bench.cell, "zero")
        assert time.monotonic() - begin < 2.0
    finally:
        os.kill(bench.pid, signal.SIGCONT)
    until(lambda: bench.cell.problem is None and bench.age < 0.1)
    bench.slow.command(bench.cell, "zero")


def test_a_stopped_process_is_ended_by_the_close(bench: Bench) -> None:
    pid = bench.pid
    os.kill(pid, signal.SIGSTOP)
    time.sleep(1.2)
    begin = time.monotonic()
    bench.process.close()
    assert time.monotonic() - begin < 1.0
    assert not runs(pid)


def test_a_process_whose_lines_hang_is_named(bench: Bench) -> None:
    """The thread of its lines alone is stopped, by ptrace(2)."""
    libc = ctypes.CDLL(None, use_errno=True)
    thread = busiest_thread(bench.pid)
    if libc.ptrace(_ATTACH, thread, None, None):
        pytest.skip(f"ptrace is not permitted here: {os.strerror(ctypes.get_errno())}")
    try:
        until(lambda: bench.cell.problem is not None)
        assert bench.age < bench.cell.max_age
        assert "does not respond" in str(bench.cell.problem)
        with pytest.raises(ConnectionLost, match="does not respond"):
            bench.slow.identify(bench.cell)
    finally:
        os.waitpid(thread, 0x40000000)  # __WALL
        libc.ptrace(_DETACH, thread, None, None)
    until(lambda: bench.cell.problem is None and bench.age < 0.1)


def test_interrupts_of_a_terminal_do_not_reach_it(bench: Bench) -> None:
    """Ctrl-C lets the bench ramp down, with readings."""
    assert os.getsid(bench.pid) != os.getsid(0)
    os.kill(bench.pid, signal.SIGINT)
    time.sleep(0.2)
    assert bench.cell.problem is None
    assert bench.age < 0.1


@pytest.mark.parametrize(
    ("interpreter", "words"),
    [("/nonexistent/python", "cannot be started"), ("/bin/false", r"has ended \(exit code 1\)")],
)
def test_a_process_that_does_not_start(
    interpreter: str, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", interpreter)
    process, spec = InstrumentProcess(CLOCK), line_at(1)
    process.adopt(spec, line_of(spec, CLOCK))
    try:
        with pytest.raises(ConnectionLost, match=words):
            started(process)
    finally:
        process.close()


def started(process: InstrumentProcess) -> None:
    process.start()
    process.await_start()


def test_without_a_line_there_is_no_process() -> None:
    process = InstrumentProcess(CLOCK)
    process.start()
    process.await_start()
    assert process.pid is None
    process.close()


_OWNER = """
    import os, sys, time
    from test_end_of_a_process import Bench
    bench = Bench({port})
    if {forked} and os.fork() == 0:
        time.sleep({forked})  # it holds copies of the pipes
        os._exit(0)
    print(bench.pid, flush=True)
    time.sleep(60)
"""


@pytest.mark.parametrize("forked", [0, 8], ids=["alone", "with a fork of the bench"])
def test_it_ends_after_its_bench_was_killed(forked: int) -> None:
    with Peer() as peer:
        peer.registers |= {6: 1 << 11, 8: 1000, 10: 1000}
        script = textwrap.dedent(_OWNER.format(port=peer.port, forked=forked))
        paths = os.pathsep.join(str(Path(path).resolve()) for path in sys.path if path)
        environment = {**os.environ, "PYTHONPATH": f"{Path(__file__).parent}{os.pathsep}{paths}"}
        with subprocess.Popen(
            [sys.executable, "-c", script], stdout=subprocess.PIPE, env=environment
        ) as owner:
            pid = int(owner.stdout.readline())
            try:
                assert runs(pid)
                owner.kill()
                owner.wait()
                assert until(lambda: not runs(pid)) < 5.0
            finally:
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
