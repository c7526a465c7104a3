"""Real-time settings of the process that runs a control loop: acquired, reported and undone.

- The control thread and the receive threads of the CAN buses run under SCHED_FIFO with a high
  priority, every other thread of the process under SCHED_FIFO with a low one. A thread left to
  the normal scheduler could be preempted by any other program while it holds Python's global
  interpreter lock, and the control thread would wait for both (priority inversion).
- The memory of the process is locked, so that no page is read from disk within a cycle.
- Python's garbage collector: objects that exist are frozen; the young generation, bounded to
  ``YOUNG`` objects, is collected as before; the older ones only while the bench is at rest.
- The interpreter lock changes hands after ``SWITCH`` instead of Python's 5 ms.
"""

from __future__ import annotations

import ctypes
import gc
import os
import sys
from collections.abc import Callable, Iterable
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field, replace
from typing import Literal

from winchkit.bench.control.computer import (
    PRIORITY,
    ComputerSetting,
    instrument_reading,
    locks_without_limit,
    memory_remedy,
    scheduling_remedy,
    threads,
)
from winchkit.bench.control.snapshot import BenchSnapshot
from winchkit.errors import NotPermitted

Request = Literal["try"] | bool
"""``"try"`` takes what is permitted, ``True`` demands priority and locked memory."""

LOW_PRIORITY = 10
"""SCHED_FIFO priority of the other threads of the process."""
SWITCH = 1e-4
"""Time after which a thread gives the interpreter lock to one that waits for it, s."""
YOUNG = 2000
"""Objects in the young generation of the garbage collector."""
_NEVER = 2**30
"""Collections of a younger generation before one of an older: none in a run of any length."""
_CURRENT, _FUTURE, _ON_FAULT = 1, 2, 4
"""MCL_CURRENT, MCL_FUTURE, MCL_ONFAULT (sys/mman.h)."""

_Scheduling = tuple[int, int]
"""Policy and priority of a thread."""


@dataclass(frozen=True)
class RealTime:
    """Granted and refused settings, with the change that would permit the latter."""

    items: tuple[ComputerSetting, ...]
    _before: dict[int, _Scheduling] = field(default_factory=dict, repr=False, compare=False)
    _undo: ExitStack = field(default_factory=ExitStack, repr=False, compare=False)

    @property
    def granted(self) -> bool:
        """Whether every setting was granted."""
        return all(item.granted for item in self.items)

    @property
    def refused(self) -> tuple[ComputerSetting, ...]:
        """Settings that were refused."""
        return tuple(item for item in self.items if not item.granted)

    @property
    def scheduled(self) -> bool:
        """Whether the threads have real-time priority."""
        return any(item.name == "scheduling" and item.granted for item in self.items)

    def cover(self, urgent: Iterable[int], companions: Iterable[int] = ()) -> None:
        """Set priorities again after threads were started; those of companion processes are low."""
        if self.scheduled:
            _prioritise(frozenset(urgent), self._before, companions)

    def with_instruments(self) -> RealTime:
        """The same, which says besides that the instrument process reads the slow lines."""
        return replace(self, items=(*self.items, instrument_reading(scheduled=self.scheduled)))

    def close(self) -> None:
        """Restore all settings; may be called twice."""
        self._undo.close()


NOT_REQUESTED = ComputerSetting(
    "real-time",
    False,
    "not requested: the control loop shares the processor with every other program",
    "open_bench(..., realtime='try')",
)


def acquire(request: Request, urgent: Iterable[int], *, simulated: bool = False) -> RealTime:
    """Take what this computer permits for the process and its ``urgent`` threads (native ids).

    Without a request the objects that exist are frozen, and nothing else is changed: a collection
    of all objects of a program with large libraries takes 0.1 s, on whichever thread it begins.
    In simulated time, which a pause does not disturb, nothing is changed. With ``True`` it raises
    NotPermitted where priority or locked memory is refused, and leaves the process as it was.
    """
    if not request:
        if simulated:
            return RealTime((NOT_REQUESTED,))
        with ExitStack() as stack:
            _freeze(stack)
            return RealTime((NOT_REQUESTED,), _undo=stack.pop_all())
    if sys.platform != "linux":
        items: tuple[ComputerSetting, ...] = (
            ComputerSetting("real-time", False, f"not available on {sys.platform}", "use Linux"),
        )
        return _demanded(RealTime(items), request)
    before: dict[int, _Scheduling] = {}
    with ExitStack() as stack:
        items = (
            _schedule(frozenset(urgent), before, stack),
            _lock_memory(stack),
            _bound_collector(stack),
            _switch_sooner(stack),
        )
        _demanded(RealTime(items), request)
        return RealTime(items, before, stack.pop_all())
    raise AssertionError("an ExitStack without handlers suppresses nothing")


def _demanded(found: RealTime, request: Request) -> RealTime:
    if request is True and found.refused:
        raise NotPermitted("\n".join(map(str, found.refused)))
    return found


class RestCollector:
    """Runs the older generations of the collector while every drive is disabled and at rest."""

    def __init__(self, period: float = 10.0, collect: Callable[[], object] = gc.collect) -> None:
        """Collect at most once a ``period`` (s)."""
        self._period, self._collect = period, collect
        self._next = float("-inf")
        self._resting = False

    def __call__(self, snapshot: BenchSnapshot) -> None:
        """Collect where the bench has come to rest, or rests for a period longer."""
        resting, self._resting = self._resting, snapshot.at_rest
        if resting and snapshot.at_rest and snapshot.time >= self._next:
            self._next = snapshot.time + self._period
            self._collect()


def _schedule(
    urgent: frozenset[int], before: dict[int, _Scheduling], stack: ExitStack
) -> ComputerSetting:
    try:
        _prioritise(urgent, before)
    except OSError as error:
        detail = f"SCHED_FIFO with priority {PRIORITY} is refused ({error.strerror})"
        return ComputerSetting("scheduling", False, detail, scheduling_remedy())
    stack.callback(_restore, before)
    detail = (
        f"SCHED_FIFO, priority {PRIORITY} for control and CAN reception, "
        f"{LOW_PRIORITY} for the rest of the process"
    )
    return ComputerSetting("scheduling", True, detail)


def _prioritise(
    urgent: frozenset[int], before: dict[int, _Scheduling], companions: Iterable[int] = ()
) -> None:
    """Give every thread of the process its priority; one set by somebody else is kept."""
    others = [one for one in threads() if one not in urgent]
    others += [one for process in companions for one in threads(process)]
    for thread in sorted(urgent) + others:
        with suppress(ProcessLookupError):
            found = _scheduling_of(thread)
            ours = found in ((os.SCHED_FIFO, PRIORITY), (os.SCHED_FIFO, LOW_PRIORITY))
            if found[0] != os.SCHED_OTHER and not ours:
                continue
            # A thread that one of ours has started inherits its priority.
            before.setdefault(thread, (os.SCHED_OTHER, 0) if ours else found)
            priority = PRIORITY if thread in urgent else LOW_PRIORITY
            os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(priority))


def _restore(before: dict[int, _Scheduling]) -> None:
    """Restore the threads' policies; those that inherited ours become ordinary."""
    for thread in threads():
        with suppress(ProcessLookupError):
            policy, priority = before.get(thread, (os.SCHED_OTHER, 0))
            if thread in before or _scheduling_of(thread) == (os.SCHED_FIFO, LOW_PRIORITY):
                os.sched_setscheduler(thread, policy, os.sched_param(priority))
    before.clear()


def _scheduling_of(thread: int) -> _Scheduling:
    return os.sched_getscheduler(thread), os.sched_getparam(thread).sched_priority


def _lock_memory(stack: ExitStack) -> ComputerSetting:
    """Lock the mapped memory and, where the limit permits, future mappings."""
    import resource

    libc = ctypes.CDLL(None, use_errno=True)
    soft, hard = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    with suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_MEMLOCK, (hard, hard))
    stack.callback(resource.setrlimit, resource.RLIMIT_MEMLOCK, (soft, hard))
    if libc.mlockall(_CURRENT):
        reason = os.strerror(ctypes.get_errno())
        limit = "unlimited" if hard == resource.RLIM_INFINITY else f"limit {hard / 2**20:.0f} MB"
        return ComputerSetting("memory", False, f"not locked ({reason}; {limit})", memory_remedy())
    stack.callback(libc.munlockall)
    # Under a limit, memory locked in advance would make a later allocation fail.
    if locks_without_limit(hard) and not libc.mlockall(_CURRENT | _FUTURE | _ON_FAULT):
        return ComputerSetting("memory", True, "locked")
    return ComputerSetting("memory", True, "locked as far as it is mapped now")


def _freeze(stack: ExitStack) -> None:
    """Let later collections leave out the objects that exist now."""
    if not gc.get_freeze_count():
        stack.callback(gc.unfreeze)
    gc.collect()
    gc.freeze()


def _bound_collector(stack: ExitStack) -> ComputerSetting:
    stack.callback(gc.set_threshold, *gc.get_threshold())
    _freeze(stack)
    gc.set_threshold(YOUNG, _NEVER, _NEVER)
    return ComputerSetting(
        "collector", True, f"frozen; {YOUNG} young objects at most, the others at rest"
    )


def _switch_sooner(stack: ExitStack) -> ComputerSetting:
    stack.callback(sys.setswitchinterval, sys.getswitchinterval())
    sys.setswitchinterval(SWITCH)
    return ComputerSetting("interpreter lock", True, f"handed over after {SWITCH * 1e3:g} ms")
