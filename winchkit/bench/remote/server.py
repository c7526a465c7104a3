"""Lets other processes take part in an owned bench: JSON lines over a local socket."""

from __future__ import annotations

import inspect
import json
import logging
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Self

from winchkit.bench.bench import Bench
from winchkit.bench.control.dead_man import LIFE_SIGN, remaining
from winchkit.bench.ownership import digest_of, listen, log_path
from winchkit.bench.remote.identity import Client, LifeSign
from winchkit.bench.remote.operation import OPERATIONS
from winchkit.bench.remote.station import LocalStation
from winchkit.errors import (
    ConnectionLost,
    FileError,
    NotPermitted,
    UsageError,
    WinchkitError,
    class_name,
)

_LOGGER = logging.getLogger(__name__)

_MAX_LINE = 65_536
"""Bytes: the longest request, a programme by name with its options, has some hundreds; a longer one
is no client."""


@dataclass(frozen=True)
class _Request:
    """A request of a client, decoded."""

    number: Any
    """By which the client finds its answer."""
    operation: str
    age: float
    """Since its client asked for it, s; this computer has one steady clock."""
    arguments: tuple[Any, ...]
    named: dict[str, Any]

    @classmethod
    def decode(cls, line: bytes) -> Self:
        """A line of the connection; raises UsageError for one that is no request."""
        try:
            asked = json.loads(line)
            return cls(
                asked["id"],
                str(asked["op"]),
                max(0.0, time.monotonic() - float(asked["sent"])),
                tuple(asked["args"]),
                {str(name): value for name, value in asked.get("named", {}).items()},
            )
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise UsageError(f"a request that cannot be read: {error}") from None

    def bound(self, call: Callable[..., Any]) -> inspect.BoundArguments:
        """Its arguments for ``call``; raises UsageError, NotPermitted for a motion that is old."""
        try:
            asked = inspect.signature(call).bind(*self.arguments, **self.named)
        except TypeError as error:
            raise UsageError(f"{self.operation}: a request that cannot be read: {error}") from None
        if OPERATIONS.get(self.operation):
            asked.apply_defaults()
            hold = asked.arguments.get("hold")
            if isinstance(hold, bool) or not isinstance(hold, float | int) or not 0 < hold <= 1:
                remaining(LIFE_SIGN, self.age)  # and the station says what is wrong with the hold
            else:
                asked.arguments["hold"] = remaining(hold, self.age)
        return asked


@dataclass(eq=False)
class _Link:
    """A client's connection, and its station once it has introduced itself."""

    connection: socket.socket
    station: LocalStation
    left: bool = False
    """Whether its client has taken its leave: what it has started was ended."""

    def leave(self) -> None:
        """End what its client has started."""
        self.left = True
        _end(self.station)


class StationServer:
    """Serves stations to other processes until closed; one thread for each."""

    def __init__(self, bench: Bench) -> None:
        self.may_hand_over = False
        """Whether the owner gives the bench to a program that wants to own it, while only
        observers are attached: a bench process does."""
        self.handed_to = ""
        """Name of the program that the bench is given to; empty while there is none."""
        self.digest = digest_of(bench.spec)
        """Of what the bench file says, for clients that read it again."""
        self._bench = bench
        self._closing = False
        self._socket, self._path = listen(bench.spec)
        self._links: set[_Link] = set()
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._accept, name="stations", daemon=True)
        self._thread.start()

    @property
    def clients(self) -> tuple[Client, ...]:
        """Who is connected."""
        return tuple(link.station.client for link in tuple(self._links))

    def close_door(self) -> bool:
        """Accept no client any more, unless one is attached; whether this was done."""
        with self._lock:
            if self.clients:
                return False
            self.handed_to = self.handed_to or "no program; it ends"
            return True

    def close(self) -> None:
        """Turn everybody out; the bench stops the winches, then finishes the logs."""
        self._closing = True
        self._path.unlink(missing_ok=True)
        for link in tuple(self._links):
            link.station.begin_no_more()
        for item in (self._socket, *(link.connection for link in tuple(self._links))):
            _shut(item)
        self._thread.join(timeout=2.0)
        self._socket.close()

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._socket.accept()
            except OSError:
                return
            unnamed = Client("a client without a name", life=LifeSign())
            link = _Link(client, LocalStation(self._bench, unnamed))
            self._links.add(link)
            threading.Thread(target=self._serve, args=(link,), name="station", daemon=True).start()

    def _serve(self, link: _Link) -> None:
        """Answer until the other side leaves or goes away, then end what it has started."""
        try:
            with link.connection as client, client.makefile("rwb") as stream:
                while not link.left and (line := stream.readline(_MAX_LINE)):
                    stream.write(self._answer(link, line) + b"\n")
                    stream.flush()
        except OSError:
            pass
        finally:
            if not link.left and not self._closing:
                with suppress(WinchkitError):
                    link.leave()
            self._links.discard(link)

    def _answer(self, link: _Link, line: bytes) -> bytes:
        """Execute a request; returns the reply."""
        request: _Request | None = None
        try:
            request = _Request.decode(line)
            if request.age < LIFE_SIGN:
                link.station.client.heard()
            answer = json.dumps({"id": request.number, "ok": self._do(link, request)})
        except WinchkitError as error:
            answer = _refusal(request, class_name(error), str(error))
        except Exception as error:
            what = "a request" if request is None else request.operation
            _LOGGER.exception("%s of %s failed", what, link.station.client.name)
            answer = _refusal(
                request,
                "WinchkitError",
                f"{what} failed in the process that owns the bench: {type(error).__name__}: "
                f"{error} (a defect of winchkit, please report it with {log_path(self._bench.spec)}"
                "; the bench goes on)",
            )
        return answer.encode()

    def _do(self, link: _Link, request: _Request) -> Any:
        """Do an operation of a station, or one of those of the server; returns its result."""
        own: dict[str, Callable[..., Any]] = {
            "introduce": lambda name, observer: self._introduce(link, name, observer),
            "hand_over": lambda: self._hand_over(link),
            "leave": link.leave,
        }
        operation = request.operation
        if operation not in own and operation not in OPERATIONS:
            raise UsageError(f"no operation '{operation}'")
        call = own.get(operation) or getattr(link.station, operation)
        asked = request.bound(call)
        return call(*asked.args, **asked.kwargs)

    def _introduce(self, link: _Link, name: str, observer: bool) -> dict[str, Any]:
        """Take a client's name; returns who owns the bench, and whether it is handed over."""
        with self._lock:
            if self.handed_to:
                raise ConnectionLost(f"the bench is being handed over to {self.handed_to}")
            link.station.client = Client(str(name), observer=bool(observer), life=LifeSign())
        return {
            "owner": self._bench.commanders.owner.name,
            "lends": self.may_hand_over,
            "digest": self.digest,
        }

    def _hand_over(self, link: _Link) -> str:
        """Give the bench to a client; raises NotPermitted, naming who uses it."""
        asking = link.station.client
        owner = self._bench.commanders.owner.name
        with self._lock:
            users = [c.name for c in self.clients if c is not asking and not c.observer]
            if not self.may_hand_over or users:
                by = f", and used by {', '.join(users)}" if users else ""
                raise NotPermitted(
                    f"bench '{self._bench.spec.name}' is owned by {owner}{by}; one process owns a "
                    "bench: end it first, or attach to it"
                )
            if self.handed_to:
                raise ConnectionLost(f"the bench is being handed over to {self.handed_to}")
            self.handed_to = asking.name
        return owner


def _refusal(request: _Request | None, kind: str, message: str) -> str:
    """The reply that raises an error in the client."""
    number = None if request is None else request.number
    return json.dumps({"id": number, "error": kind, "message": message})


def _end(station: LocalStation) -> None:
    """Close a station; its errors are logged too."""
    try:
        station.close()
    except FileError:
        pass  # the recorder has said why the log ended, and its client has gone
    except WinchkitError as error:
        _LOGGER.error("a station did not end as it should: %s", error)  # noqa: TRY400
        raise


def _shut(item: socket.socket) -> None:
    """Wake whoever waits on a socket."""
    try:
        item.shutdown(socket.SHUT_RDWR)
    except OSError:
        item.close()
