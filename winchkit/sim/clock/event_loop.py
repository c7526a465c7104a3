"""An asyncio event loop in simulated time; its TCP connections stay within the process."""

from __future__ import annotations

import asyncio
from asyncio import base_events
from collections.abc import Callable
from typing import Any, Protocol

_LATENCY = 2e-4
"""Delay from one end of a connection to the other, s."""
_FIRST_PORT = 20_000
"""Below it are registered services; the ports are of the simulated network only."""


class _Clock(Protocol):
    """Members of a simulated clock that an event loop needs."""

    listeners: dict[tuple[str, int], Any]
    """TCP servers by host and port."""
    reply_filter: Callable[[bytes], bytes] | None

    def now(self) -> float:
        """Simulated time, s."""
        ...

    def call_at(self, time: float, callback: Callable[[], None]) -> None:
        """Call a function at a time, s."""
        ...

    def event(self) -> Any:
        """An event whose time-outs are in simulated time."""
        ...

    def thread(self, target: Callable[[], None], name: str) -> Any:
        """A thread in simulated time."""
        ...


class _Selector:
    """Waits on the clock instead of on sockets."""

    def __init__(self, clock: _Clock) -> None:
        self.woken = clock.event()

    def select(self, timeout: float | None) -> list[Any]:
        """Return after ``timeout`` s, or as soon as another thread wakes the loop."""
        if timeout is None or timeout > 0:
            self.woken.wait(timeout)
        self.woken.clear()
        return []


class SimulatedEventLoop(base_events.BaseEventLoop):
    """Runs on a thread of a :class:`~winchkit.sim.clock.simulated_clock.SimulatedClock`."""

    def __init__(self, clock: _Clock) -> None:
        super().__init__()
        self._simulated = clock
        self._selector = _Selector(clock)

    def time(self) -> float:
        """Simulated time, s."""
        return self._simulated.now()

    async def create_connection(  # type: ignore[override]
        self, protocol_factory: Callable[[], Any], host: str, port: int, **_: Any
    ) -> tuple[asyncio.Transport, Any]:
        """Connect to a server of the same clock; raises ConnectionRefusedError."""
        server: _Server | None = self._simulated.listeners.get((host, int(port)))
        await asyncio.sleep(_LATENCY)
        if server is None:
            raise ConnectionRefusedError(f"there is no server at {host}:{port} of the simulation")
        near = _Transport(self, self._simulated, protocol_factory())
        far = _Transport(server.loop, self._simulated, None)
        near.peer, far.peer = far, near
        server.loop.call_soon_threadsafe(far.accept, server.factory)
        near.protocol.connection_made(near)
        return near, near.protocol

    async def create_server(  # type: ignore[override]
        self, protocol_factory: Callable[[], Any], host: str, port: int, **_: Any
    ) -> _Server:
        """Listen on the simulated network; port 0 means any free port. Raises OSError."""
        listeners = self._simulated.listeners
        number = int(port) or max((p for _, p in listeners), default=_FIRST_PORT) + 1
        if (host, number) in listeners:
            raise OSError(f"{host}:{number} of the simulation is in use")
        server = _Server(self, self._simulated, protocol_factory, (host, number))
        listeners[host, number] = server
        return server

    def run_in_executor(  # type: ignore[override]
        self, executor: Any, function: Callable[..., Any], *arguments: Any
    ) -> asyncio.Future[Any]:
        """Call a function on a thread of the clock."""
        future: asyncio.Future[Any] = self.create_future()

        def finish(result: Any, error: BaseException | None) -> None:
            if future.cancelled():
                return
            if error is None:
                future.set_result(result)
            else:
                future.set_exception(error)

        def run() -> None:
            result, error = None, None
            try:
                result = function(*arguments)
            except BaseException as raised:  # noqa: BLE001 - raised in the awaiting code
                error = raised
            if not self.is_closed():
                self.call_soon_threadsafe(finish, result, error)

        self._simulated.thread(run, "executor").start()
        return future

    def _write_to_self(self) -> None:
        self._selector.woken.set()

    def _process_events(self, _events: list[Any]) -> None:
        """There are no sockets."""


class _Server:
    """A listening end, which is its own socket object."""

    def __init__(
        self,
        loop: SimulatedEventLoop,
        clock: _Clock,
        factory: Callable[[], Any],
        address: tuple[str, int],
    ) -> None:
        self.loop, self.factory = loop, factory
        self.sockets = [self]
        self._clock, self._address = clock, address

    def getsockname(self) -> tuple[str, int]:
        """Host and port."""
        return self._address

    def close(self) -> None:
        """Stop listening."""
        self._clock.listeners.pop(self._address, None)


class _Transport(asyncio.Transport):
    """One end of a connection; bytes arrive at the other end in order."""

    def __init__(self, loop: SimulatedEventLoop, clock: _Clock, protocol: Any) -> None:
        super().__init__()
        self.loop, self.protocol = loop, protocol
        self.peer: _Transport | None = None
        self.is_server = False
        self._clock = clock
        self._closed = False

    def is_closing(self) -> bool:
        """Whether it is closed."""
        return self._closed

    def accept(self, factory: Callable[[], Any]) -> None:
        """Start the server's end, in its loop."""
        self.is_server, self.protocol = True, factory()
        self.protocol.connection_made(self)

    def write(self, data: Any) -> None:
        """Send bytes."""
        if self.is_server and self._clock.reply_filter is not None:
            data = self._clock.reply_filter(bytes(data))
        if data and not self._closed and self.peer is not None:
            self._later(self.peer, self.peer.take, bytes(data))

    def take(self, data: bytes) -> None:
        """Take bytes that have arrived."""
        if not self._closed:
            self.protocol.data_received(data)

    def close(self) -> None:
        """Close this end, which is reported to the other one."""
        if self._closed:
            return
        self._closed = True
        if not self.loop.is_closed():
            self.loop.call_soon_threadsafe(self.protocol.connection_lost, None)
        if self.peer is not None:
            self._later(self.peer, self.peer.close)

    def abort(self) -> None:
        """Close at once."""
        self.close()

    def _later(self, other: _Transport, function: Callable[..., None], *arguments: Any) -> None:
        def arrive() -> None:
            if not other.loop.is_closed():
                other.loop.call_soon_threadsafe(function, *arguments)

        self._clock.call_at(self._clock.now() + _LATENCY, arrive)
