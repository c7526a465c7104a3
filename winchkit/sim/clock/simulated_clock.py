"""A discrete-event clock: time advances to the next event when all threads wait.

Threads that wait on this clock run one at a time, in the order of their events (time, then order
of scheduling). A thread that starts to wait executes the events that are due, and transfers control
to the thread whose event is next. Two runs with the same inputs are therefore identical, and a run
takes only as long as its computations.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from heapq import heappop, heappush
from itertools import count
from math import inf
from typing import Any

from winchkit.errors import WinchkitError


class _Waiter:
    """One wait of one thread; it is woken once."""

    __slots__ = ("device", "fired", "gate", "guest")

    def __init__(self, *, device: bool, guest: bool) -> None:
        self.device, self.guest = device, guest
        self.fired = False
        self.gate = threading.Lock()
        self.gate.acquire()


class SimulatedClock:
    """Time, threads, events, event loops and in-process lines of one simulated bench.

    The thread that creates the clock is part of it: time stands still while that thread computes,
    and advances while it sleeps or waits on this clock. Threads are started by :meth:`thread`. Any
    other thread may call :meth:`now` and :meth:`sleep`, but time does not wait for it. Callbacks
    (:meth:`call_at`) run between the threads.

    Parameters
    ----------
    start : float
        First time, s.
    """

    def __init__(self, start: float = 1000.0) -> None:
        self.failure: BaseException | None = None
        """First exception of a callback; raised in the thread that created the clock."""
        self._time = start
        self._events: list[tuple[float, int, _Waiter | Callable[[], None]]] = []
        self._order = count()
        self._owner = threading.get_ident()
        self._device_threads: set[int] = set()
        self._members = {self._owner}
        self._stalled_until = -inf
        self._can: dict[str, Callable[[], Any]] = {}
        self._serial: dict[str, Callable[[], Any]] = {}
        self._datagrams: dict[str, Callable[[bytes], None]] = {}
        self.listeners: dict[tuple[str, int], Any] = {}
        """TCP servers of the simulated network by host and port, see ``event_loop``."""
        self.reply_filter: Callable[[bytes], bytes] | None = None
        """Changes the data that TCP servers send, e.g. corrupts them; empty data are not sent."""

    # Time.

    def now(self) -> float:
        """Simulated time, s."""
        return self._time

    def sleep(self, duration: float) -> None:
        """Return after ``duration`` seconds of simulated time; at once when it is not positive.

        Parameters
        ----------
        duration : float
            s.
        """
        if duration > 0:
            waiter = self._waiter()
            self._push(self._time + duration, waiter)
            self._wait(waiter)

    def call_at(self, time: float, callback: Callable[[], None]) -> None:
        """Call a function at a time (s), between the threads; it must not wait.

        Parameters
        ----------
        time : float
            On this clock, s; one in the past is the present.
        callback : callable
            Called without arguments.
        """
        self._push(max(time, self._time), callback)

    def stall(self, duration: float) -> None:
        """Suspend the threads of the host computer for ``duration`` s.

        Callbacks and threads of devices continue.

        Parameters
        ----------
        duration : float
            s.
        """
        self._stalled_until = max(self._stalled_until, self._time + duration)

    # Threads and what they wait for.

    def thread(
        self, target: Callable[[], None], name: str, *, device: bool = False
    ) -> SimulatedThread:
        """A thread in simulated time, not yet started.

        ``device`` threads belong to simulated devices: a stall of the host does not suspend them.

        Parameters
        ----------
        target : callable
            Called without arguments.
        name : str
            Of the thread.
        device : bool
            Whether it belongs to a simulated device.

        Returns
        -------
        SimulatedThread
            Used like ``threading.Thread``.
        """
        return SimulatedThread(self, target, name, device=device)

    def event(self) -> SimulatedEvent:
        """An event like ``threading.Event``; time-outs are in simulated time."""
        return SimulatedEvent(self)

    def lock(self) -> SimulatedLock:
        """A lock whose holder may wait on this clock."""
        return SimulatedLock(self)

    def event_loop(self) -> asyncio.AbstractEventLoop:
        """An asyncio event loop in simulated time, whose TCP connections stay in the process."""
        from winchkit.sim.clock.event_loop import SimulatedEventLoop

        return SimulatedEventLoop(self)

    # Lines into the simulation.

    def serve_can(self, channel: str, connect: Callable[[], Any]) -> None:
        """Register a simulated CAN bus by its channel.

        Parameters
        ----------
        channel : str
            Channel in the bench file.
        connect : callable
            Returns a new port of the bus.
        """
        self._can[channel] = connect

    def serve_serial(self, port: str, connect: Callable[[], Any]) -> None:
        """Register a simulated serial line by the name of its port.

        Parameters
        ----------
        port : str
            Port in the bench file.
        connect : callable
            Returns the line.
        """
        self._serial[port] = connect

    def can_port(self, channel: str) -> Any | None:
        """A new connection to the simulated CAN bus of a channel; None where there is none.

        Parameters
        ----------
        channel : str
            Channel in the bench file.

        Returns
        -------
        object or None
            A port with ``transmit``, ``receive``, ``send`` and ``close``.
        """
        connect = self._can.get(channel)
        return None if connect is None else connect()

    def serial_port(self, port: str) -> Any | None:
        """The simulated serial line behind a port; None where there is none.

        Parameters
        ----------
        port : str
            Port in the bench file.

        Returns
        -------
        object or None
            The line.
        """
        connect = self._serial.get(port)
        return None if connect is None else connect()

    def receive_datagrams(self, address: str, take: Callable[[bytes], None]) -> None:
        """Receive what simulated devices send to an address, until another receiver does.

        Parameters
        ----------
        address : str
            ``udp://HOST:PORT``.
        take : callable
            Called with each datagram.
        """
        self._datagrams[address] = take

    def send_datagram(self, address: str, datagram: bytes) -> None:
        """Deliver a datagram to who receives at an address; without a receiver it is lost.

        Parameters
        ----------
        address : str
            ``udp://HOST:PORT``.
        datagram : bytes
            Its content.
        """
        if (take := self._datagrams.get(address)) is not None:
            take(datagram)

    # How threads take turns.

    def wake(self, waiter: _Waiter) -> None:
        """Resume a waiting thread after all events that are due already.

        Parameters
        ----------
        waiter
            Handle of :meth:`wait`.
        """
        self._push(self._time, waiter)

    def wait(self, timeout: float | None, register: Callable[[_Waiter], None]) -> None:
        """Wait until woken or for ``timeout`` s; ``register`` takes the handle of the wait.

        Parameters
        ----------
        timeout : float or None
            s; None waits without limit.
        register : callable
            Takes the handle, for :meth:`wake`.
        """
        waiter = self._waiter()
        register(waiter)
        if timeout is not None:
            self._push(self._time + max(0.0, timeout), waiter)
        self._wait(waiter)

    def enter(self, *, device: bool) -> None:
        """Add the calling thread; for :class:`SimulatedThread`.

        Parameters
        ----------
        device : bool
            Whether the thread belongs to a simulated device.
        """
        self._members.add(threading.get_ident())
        if device:
            self._device_threads.add(threading.get_ident())

    def leave(self) -> None:
        """Remove the calling thread and transfer control to the next one."""
        self._members.discard(threading.get_ident())
        self._device_threads.discard(threading.get_ident())
        following = self._next(None)
        if following is not None:
            following.gate.release()

    def _waiter(self) -> _Waiter:
        own = threading.get_ident()
        return _Waiter(device=own in self._device_threads, guest=own not in self._members)

    def _push(self, time: float, item: Any) -> None:
        heappush(self._events, (time, next(self._order), item))

    def _wait(self, waiter: _Waiter) -> None:
        if waiter.guest:
            waiter.gate.acquire()
            return
        following = self._next(waiter)
        if following is waiter:
            self._raise_failure()
            return
        if following is None:
            raise WinchkitError(
                "simulated time cannot advance: every thread waits for another one without a "
                "time-out; a thread of this bench waits for an event outside the simulation"
            )
        following.gate.release()
        try:
            waiter.gate.acquire()
        except BaseException:
            # An interrupt: continue only at this thread's turn, since one thread runs at a time. A
            # signal may also end the wait after the turn was given: then it is not given again.
            if not waiter.fired:
                self.wake(waiter)
                waiter.gate.acquire()
            raise
        self._raise_failure()

    def _next(self, own: _Waiter | None) -> _Waiter | None:
        """Execute callbacks until it is a thread's turn; None where nothing is scheduled."""
        events = self._events
        while events:
            time, order, item = heappop(events)
            if isinstance(item, _Waiter):
                if item.fired:
                    continue
                if self._stalled_until > max(time, self._time) and not item.device:
                    heappush(events, (self._stalled_until, order, item))
                    continue
                self._time = max(self._time, time)
                item.fired = True
                if item.guest:
                    item.gate.release()
                    continue
                return item
            self._time = max(self._time, time)
            try:
                item()
            except BaseException as error:  # noqa: BLE001 - kept, and raised in the owner's thread
                self.failure = self.failure or error
        return None

    def _raise_failure(self) -> None:
        if self.failure is not None and threading.get_ident() == self._owner:
            error, self.failure = self.failure, None
            raise error


class SimulatedThread:
    """A thread in simulated time; used like ``threading.Thread``."""

    def __init__(
        self, clock: SimulatedClock, target: Callable[[], None], name: str, *, device: bool
    ) -> None:
        self._clock, self._target, self._device = clock, target, device
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._turn = _Waiter(device=device, guest=False)
        self._ended = SimulatedEvent(clock)
        self._started = False

    def start(self) -> None:
        """Start it at its turn."""
        self._started = True
        self._clock.wake(self._turn)
        self._thread.start()

    def join(self, timeout: float | None = None) -> None:
        """Wait until it has ended, at most ``timeout`` s of simulated time."""
        if self._started:
            self._ended.wait(timeout)

    def is_alive(self) -> bool:
        """Whether it runs."""
        return self._started and not self._ended.is_set()

    def _run(self) -> None:
        self._turn.gate.acquire()
        self._clock.enter(device=self._device)
        try:
            self._target()
        finally:
            self._ended.set()
            self._clock.leave()


class SimulatedEvent:
    """Used like ``threading.Event``."""

    def __init__(self, clock: SimulatedClock) -> None:
        self._clock = clock
        self._set = False
        self._waiting: list[_Waiter] = []

    def is_set(self) -> bool:
        """Whether it is set."""
        return self._set

    def set(self) -> None:
        """Set it and resume the waiting threads."""
        self._set = True
        waiting, self._waiting = self._waiting, []
        for waiter in waiting:
            self._clock.wake(waiter)

    def clear(self) -> None:
        """Reset it."""
        self._set = False

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until it is set, at most ``timeout`` s; whether it is set."""
        if not self._set:
            self._clock.wait(timeout, self._waiting.append)
            self._waiting = [waiter for waiter in self._waiting if not waiter.fired]
        return self._set


class SimulatedLock:
    """Used like ``threading.Lock``."""

    def __init__(self, clock: SimulatedClock) -> None:
        self._free = SimulatedEvent(clock)
        self._free.set()

    def __enter__(self) -> None:
        while not self._free.is_set():
            self._free.wait()
        self._free.clear()

    def __exit__(self, *_: object) -> None:
        self._free.set()
