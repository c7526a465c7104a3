"""Threads, events, locks and event loops that wait on the bench's clock.

With the machine's clock they are those of the standard library. A clock of simulated time brings
its own (:class:`Scheduler`), so that everything that waits advances with it.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any, Protocol, runtime_checkable

from winchkit.drivers.clock import Clock


class WaitableEvent(Protocol):
    """Used part of ``threading.Event``."""

    def is_set(self) -> bool:
        """Whether it is set."""

    def set(self) -> None:
        """Set it."""

    def clear(self) -> None:
        """Reset it."""

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until it is set, at most ``timeout`` s; whether it is set."""


class Thread(Protocol):
    """Used part of ``threading.Thread``."""

    def start(self) -> None:
        """Start it."""

    def join(self, timeout: float | None = None) -> None:
        """Wait until it has ended, at most ``timeout`` s."""

    def is_alive(self) -> bool:
        """Whether it runs."""


@runtime_checkable
class Scheduler(Protocol):
    """A clock that schedules the threads that wait on it, and has simulated lines."""

    def thread(self, target: Callable[[], None], name: str) -> Thread:
        """A thread, not started yet."""

    def event(self) -> WaitableEvent:
        """An event."""

    def lock(self) -> AbstractContextManager[None]:
        """A lock that may be held while its holder waits on the clock."""

    def event_loop(self) -> asyncio.AbstractEventLoop:
        """An event loop whose time is this clock's."""

    def can_port(self, channel: str) -> Any | None:
        """A port of the simulated CAN bus of this channel; None where there is none."""

    def serial_port(self, port: str) -> Any | None:
        """The simulated serial line of this name; None where there is none."""

    def receive_datagrams(self, address: str, take: Callable[[bytes], None]) -> None:
        """Call a function with each datagram that a simulated device sends to an address."""


def thread_of(clock: Clock, target: Callable[[], None], name: str) -> Thread:
    """A daemon thread, not started yet."""
    if isinstance(clock, Scheduler):
        return clock.thread(target, name)
    return threading.Thread(target=target, name=name, daemon=True)


def event_of(clock: Clock) -> WaitableEvent:
    """An event."""
    return clock.event() if isinstance(clock, Scheduler) else threading.Event()


def lock_of(clock: Clock) -> AbstractContextManager[Any]:
    """A lock that may be held while its holder waits on the clock."""
    return clock.lock() if isinstance(clock, Scheduler) else threading.Lock()


def event_loop_of(clock: Clock) -> asyncio.AbstractEventLoop:
    """A new event loop."""
    return clock.event_loop() if isinstance(clock, Scheduler) else asyncio.new_event_loop()
