"""A station at a bench that another process owns."""

from __future__ import annotations

import json
import socket
import threading
from typing import Any

from winchkit import errors
from winchkit.bench.owner import connect_to_owner
from winchkit.drivers.can.fitting import Identity
from winchkit.drivers.can.scan import Found
from winchkit.errors import ConnectionLost, WinchkitError
from winchkit.schema.bench import BenchSpec

__all__ = ["RemoteCells", "RemoteStation", "attach"]

_ANSWER_TIME = 10.0
_CELL_TIME = 20.0
"""Longer than any command to an instrument with the readings before and after it, s."""


def attach(spec: BenchSpec, patience: float = _ANSWER_TIME) -> RemoteStation | None:
    """A station at the bench's owner; None when nobody owns it.

    ``patience`` (s) is how long it waits for an answer. Raises ConnectionLost when the owner
    does not take it.
    """
    connection = connect_to_owner(spec)
    return None if connection is None else RemoteStation(connection, patience)


class RemoteStation:
    """Calls the owner for everything; its errors are raised here."""

    def __init__(self, connection: socket.socket, patience: float) -> None:
        connection.settimeout(patience)
        self._patience = patience
        self._connection = connection
        self._stream = connection.makefile("rwb")
        self._lock = threading.Lock()

    def names(self) -> list[str]:
        """Winches there are."""
        return [str(name) for name in self._call("names")]

    def status(self) -> dict[str, Any]:
        """Newest snapshot as JSON has it."""
        return dict(self._call("status"))

    def jog(self, winch: str | None, speed: float, hold: float) -> None:
        """Keep moving for ``hold`` seconds."""
        self._call("jog", winch, speed, hold)

    def step(self, winch: str | None, change: float, speed: float | None) -> None:
        """Start to change the cable length."""
        self._call("step", winch, change, speed)

    def move(
        self,
        winch: str | None,
        to: float | None,
        by: float | None,
        speed: float | None = None,
        acceleration: float | None = None,
    ) -> None:
        """Start a move to a cable length, or by a change of it."""
        self._call("move", winch, to, by, speed, acceleration)

    def upload(self, winch: str | None, index: int, sub: int) -> bytes | None:
        """Bytes of an object of a drive."""
        found = self._call("read_object", winch, index, sub)
        return None if found is None else bytes.fromhex(found)

    def scan(self) -> list[Found]:
        """Who is on the buses."""
        return [
            Found(**{**item, "identity": Identity(**item["identity"])})
            for item in self._call("scanned")
        ]

    def moving(self, winch: str | None) -> bool:
        """Whether a motion is under way."""
        return bool(self._call("moving", winch))

    def home(
        self, winch: str | None, method: int | None, at: float | None, speed: float | None
    ) -> None:
        """Start to home a winch."""
        self._call("home", winch, method, at, speed)

    def homing(self) -> bool:
        """Whether the homing is under way."""
        return bool(self._call("homing"))

    def stop(self) -> None:
        """Quick-stop every winch."""
        self._call("stop")

    def reset(self) -> None:
        """Clear trips and faults."""
        self._call("reset")

    def tare(self, winch: str | None) -> float:
        """Tare a load cell."""
        return float(self._call("tare", winch))

    def start_log(self, path: str, rotate: str | None = None) -> None:
        """Log to a file in the owner's process."""
        self._call("start_log", path, rotate)

    def log_rows(self) -> int:
        """Rows written so far."""
        return int(self._call("log_rows"))

    def end_log(self) -> int:
        """Finish the log."""
        return int(self._call("end_log"))

    def counters(self) -> dict[str, dict[str, Any]]:
        """What was counted by instrument, and for the log."""
        return dict(self._call("counters"))

    def cell(self, task: str, name: str, *arguments: Any) -> dict[str, Any]:
        """Something with an instrument, e.g. "zero"; ``arguments`` are times (s), or words."""
        watched = sum(item for item in arguments if isinstance(item, float))
        self._connection.settimeout(_CELL_TIME + 3 * watched)
        try:
            return dict(self._call("cell", task, name, *arguments))
        finally:
            self._connection.settimeout(self._patience)

    def close(self) -> None:
        """Go away; the owner ends what was started here."""
        with self._lock:
            self._stream.close()
            self._connection.close()

    def _call(self, operation: str, *arguments: Any) -> Any:
        request = json.dumps({"op": operation, "args": arguments}).encode() + b"\n"
        with self._lock:
            try:
                self._stream.write(request)
                self._stream.flush()
                line = self._stream.readline()
            except OSError as error:
                raise ConnectionLost(f"the bench's owner does not answer: {error}") from error
        if not line:
            raise ConnectionLost("the process that owned the bench has ended; its drives stop")
        answer = json.loads(line)
        if "error" in answer:
            raise _error(answer["error"], answer["message"])
        return answer["ok"]


class RemoteCells:
    """The instruments of a bench that another process owns."""

    def __init__(self, spec: BenchSpec, station: RemoteStation) -> None:
        self.spec, self._station = spec, station

    def do(self, task: str, name: str, *arguments: Any) -> dict[str, Any]:
        """One of :data:`~winchkit.bench.cell_tasks.TASKS`, done by the owner."""
        return self._station.cell(task, name, *arguments)


def _error(name: str, message: str) -> WinchkitError:
    """The owner's error as the same class here."""
    kind = getattr(errors, name, WinchkitError)
    if isinstance(kind, type) and issubclass(kind, WinchkitError):
        return kind(message)
    return WinchkitError(message)
