"""Lets other processes take part in an owned bench: JSON lines over a local socket."""

from __future__ import annotations

import json
import logging
import socket
import threading
from typing import TYPE_CHECKING, Any

from winchkit.bench.owner import listen
from winchkit.bench.station import LocalStation
from winchkit.errors import FileError, UsageError, WinchkitError

if TYPE_CHECKING:
    from winchkit.bench.bench import Bench

__all__ = ["OPERATIONS", "StationServer"]

_LOGGER = logging.getLogger(__name__)

OPERATIONS = (
    "names",
    "status",
    "jog",
    "step",
    "move",
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
    "read_object",
    "scanned",
    "cell",
)
"""Methods of a station that may be called from outside."""

_MAX_LINE = 65_536


class StationServer:
    """Serves stations to other processes until closed; one thread for each."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._socket, self._path = listen(bench.spec)
        self._clients: set[socket.socket] = set()
        self._thread = threading.Thread(target=self._accept, name="stations", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Turn everybody out."""
        for item in (self._socket, *tuple(self._clients)):
            _shut(item)
        self._thread.join(timeout=2.0)
        self._socket.close()
        self._path.unlink(missing_ok=True)

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._socket.accept()
            except OSError:
                return
            self._clients.add(client)
            threading.Thread(
                target=self._serve, args=(client,), name="station", daemon=True
            ).start()

    def _serve(self, client: socket.socket) -> None:
        """Answer until the other side goes away, then end what it has started."""
        station = LocalStation(self._bench)
        try:
            with client, client.makefile("rwb") as stream:
                while line := stream.readline(_MAX_LINE):
                    stream.write(json.dumps(_answer(station, line)).encode() + b"\n")
                    stream.flush()
        except OSError:
            pass
        finally:
            self._clients.discard(client)
            _end(station)


def _end(station: LocalStation) -> None:
    """Close a station that nobody listens to any more; what goes wrong there goes to the log."""
    try:
        station.close()
    except FileError:
        pass  # the recorder has said why the log ended, and its client has gone
    except WinchkitError as error:
        _LOGGER.error("a station did not end as it should: %s", error)  # noqa: TRY400


def _answer(station: LocalStation, line: bytes) -> dict[str, Any]:
    """Call what a request names; errors of ours travel as their class and message."""
    try:
        request = json.loads(line)
        operation, arguments = request["op"], request.get("args", [])
        if operation not in OPERATIONS:
            raise UsageError(f"no operation '{operation}'")
        return {"ok": getattr(station, operation)(*arguments)}
    except WinchkitError as error:
        return {"error": type(error).__name__, "message": str(error)}
    except (ValueError, KeyError, TypeError) as error:
        return {"error": "UsageError", "message": f"a request that cannot be read: {error}"}


def _shut(item: socket.socket) -> None:
    """Wake whoever waits on a socket."""
    try:
        item.shutdown(socket.SHUT_RDWR)
    except OSError:
        item.close()
