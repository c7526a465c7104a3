"""Lets other processes take part in an owned bench: JSON lines over a local socket."""

from __future__ import annotations

import json
import logging
import socket
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from winchkit.bench.bench import Bench
from winchkit.bench.ownership import digest_of, listen
from winchkit.bench.remote.identity import Client, LifeSign
from winchkit.bench.remote.station import LocalStation
from winchkit.errors import (
    ConnectionLost,
    FileError,
    NotPermitted,
    UsageError,
    WinchkitError,
    class_name,
)

__all__ = ["OPERATIONS", "StationServer"]

_LOGGER = logging.getLogger(__name__)

OPERATIONS = (
    "names",
    "status",
    "jog",
    "release",
    "step",
    "move",
    "move_pose",
    "pose",
    "hold_tension",
    "take_over",
    "moving",
    "home",
    "homing",
    "stop",
    "reset",
    "tare",
    "start_log",
    "log_rows",
    "end_log",
    "counters",
    "trip_history",
    "frames",
    "start_programme",
    "programme",
    "answer_programme",
    "end_programme",
    "read_object",
    "scanned",
    "cell",
)
"""Methods of a station that may be called from outside."""

_MAX_LINE = 65_536
"""Bytes: the longest request, a programme by name with its options, has some hundreds; a longer one
is no client."""


@dataclass(eq=False)
class _Seat:
    """A client's connection, and its station once it has introduced itself."""

    connection: socket.socket
    station: LocalStation


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
        self._seats: set[_Seat] = set()
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._accept, name="stations", daemon=True)
        self._thread.start()

    @property
    def clients(self) -> tuple[Client, ...]:
        """Who is connected."""
        return tuple(seat.station.client for seat in tuple(self._seats))

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
        for seat in tuple(self._seats):
            seat.station.begin_no_more()
        for item in (self._socket, *(seat.connection for seat in tuple(self._seats))):
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
            seat = _Seat(client, LocalStation(self._bench, unnamed))
            self._seats.add(seat)
            threading.Thread(target=self._serve, args=(seat,), name="station", daemon=True).start()

    def _serve(self, seat: _Seat) -> None:
        """Answer until the other side leaves or goes away, then end what it has started."""
        left = False
        try:
            with seat.connection as client, client.makefile("rwb") as stream:
                while not left and (line := stream.readline(_MAX_LINE)):
                    answer, left = self._answer(seat, line)
                    stream.write(json.dumps(answer).encode() + b"\n")
                    stream.flush()
        except OSError:
            pass
        finally:
            if not left and not self._closing:
                with suppress(WinchkitError):
                    _end(seat.station)
            self._seats.discard(seat)

    def _answer(self, seat: _Seat, line: bytes) -> tuple[dict[str, Any], bool]:
        """Execute a request; returns the reply, and whether the request was the last one."""
        seat.station.client.heard()
        operation, number = "", None
        try:
            request = json.loads(line)
            operation, number = request["op"], request["id"]
            answer = {"ok": self._do(seat, operation, request["args"], request.get("named", {}))}
        except WinchkitError as error:
            answer = {"error": class_name(error), "message": str(error)}
        except (ValueError, KeyError, TypeError) as error:
            words = f"a request that cannot be read: {error}"
            answer = {"error": "UsageError", "message": words}
        return {"id": number, **answer}, operation == "leave"

    def _do(
        self, seat: _Seat, operation: str, arguments: Sequence[Any], named: Mapping[str, Any]
    ) -> Any:
        """Do an operation of a station, or one of those of the server; returns its result."""
        if operation == "introduce":
            return self._introduce(seat, *arguments)
        if operation == "hand_over":
            return self._hand_over(seat)
        if operation == "leave":
            _end(seat.station)
            return None
        if operation not in OPERATIONS:
            raise UsageError(f"no operation '{operation}'")
        return getattr(seat.station, operation)(*arguments, **named)

    def _introduce(self, seat: _Seat, name: str, observer: bool) -> dict[str, Any]:
        """Take a client's name; returns who owns the bench, and whether it is handed over."""
        with self._lock:
            if self.handed_to:
                raise ConnectionLost(f"the bench is being handed over to {self.handed_to}")
            seat.station.client = Client(str(name), observer=bool(observer), life=LifeSign())
        return {
            "owner": self._bench.commanders.owner.name,
            "lends": self.may_hand_over,
            "digest": self.digest,
        }

    def _hand_over(self, seat: _Seat) -> str:
        """Give the bench to a client; raises NotPermitted, naming who uses it."""
        asking = seat.station.client
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
