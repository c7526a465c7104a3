"""The cause of a standstill by the kernel's counters: made counters, and true causes."""

from __future__ import annotations

import sys
import threading
import time
from pathlib import Path

import pytest

from winchkit.bench.control.standstill import StandstillCause

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="counters of Linux")

_GAP = 0.4


def write_counters(proc: Path, *, waited: float = 0.0) -> None:
    """The file of proc(5) with a wait of the thread for a processor, s."""
    (proc / "thread-self").mkdir(parents=True, exist_ok=True)
    (proc / "thread-self" / "schedstat").write_text(f"1000 {int(waited * 1e9)} 7\n")


def test_a_counter_that_grew_with_the_gap_is_the_cause(tmp_path: Path) -> None:
    write_counters(tmp_path)
    cause = StandstillCause(proc=tmp_path)
    cause.note(10.0)
    write_counters(tmp_path, waited=0.38)
    told = cause.explain(10.0 + _GAP, _GAP, between=_GAP)
    assert told == "other programs had the processor for 0.38 s (between two cycles)"


def test_no_counter_that_grew_is_no_invented_cause(tmp_path: Path) -> None:
    write_counters(tmp_path)
    cause = StandstillCause(proc=tmp_path)
    cause.note(10.0)
    told = cause.explain(10.0 + _GAP, _GAP, between=0.001)
    assert told.startswith("other programs, the host of a virtual machine, a suspended process")
    assert told.endswith("(within a cycle)")


def test_a_missing_counter_is_not_taken_for_zero_or_for_a_cause(tmp_path: Path) -> None:
    cause = StandstillCause(proc=tmp_path / "nothing")
    cause.note(10.0)
    assert "suspended" in cause.explain(10.0 + _GAP, _GAP, between=_GAP)


def test_the_control_thread_computes() -> None:
    cause = StandstillCause()
    cause.note(0.0)
    end = time.thread_time() + 0.2
    while time.thread_time() < end:
        pass
    assert "the control thread computed for 0.2" in cause.explain(0.2, 0.2, between=0.0)


def test_another_thread_computes() -> None:
    """It holds the interpreter lock in one call: the control thread is not runnable meanwhile."""
    cause = StandstillCause()
    cause.note(0.0)
    many = list(range(3_000_000))
    used: list[float] = []

    def sort() -> None:
        begin = time.thread_time()
        many.sort(key=str)
        used.append(time.thread_time() - begin)

    thread = threading.Thread(target=sort)
    thread.start()
    thread.join()
    told = cause.explain(used[0], used[0], between=0.0)
    assert "other threads of this process computed" in told


def test_counters_are_read_at_most_every_tenth_of_a_second(tmp_path: Path) -> None:
    """What the thread waited before the last reading belongs to no standstill after it."""
    write_counters(tmp_path)
    cause = StandstillCause(proc=tmp_path)
    cause.note(10.0)
    write_counters(tmp_path, waited=0.38)
    cause.note(10.2)
    assert "other programs had" not in cause.explain(10.2 + _GAP, _GAP, between=_GAP)


def test_simulated_time_has_no_counters() -> None:
    cause = StandstillCause(counted=False)
    cause.note(0.0)
    assert "suspended" in cause.explain(1.0, 1.0, between=1.0)
