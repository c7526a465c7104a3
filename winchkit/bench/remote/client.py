"""A station at a bench that another process owns: its requests to the owner, and their answers."""

from __future__ import annotations

import json
import socket
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from numbers import Real
from typing import TYPE_CHECKING, Any, Self

from winchkit.bench.ownership import connect_to_owner
from winchkit.bench.remote.identity import client_name
from winchkit.bench.remote.operations import Station
from winchkit.drivers.clock import Clock, MonotonicClock
from winchkit.errors import ConnectionLost, UsageError, error_of
from winchkit.schema.bench import BenchSpec

if TYPE_CHECKING:
    from winchkit.drivers.can.tools.scan import ScannedNode

_ANSWER_TIME = 10.0
"""s: longer than the longest answer without a motion, a reset of several drives (some seconds)."""
_CELL_TIME = 20.0
"""Longer than any command to an instrument with the readings before and after it, s."""


def attach(
    spec: BenchSpec,
    timeout: float = _ANSWER_TIME,
    *,
    name: str = "",
    observer: bool = False,
) -> RemoteStation | None:
    """A station at the bench's owner; None when no process owns it.

    ``timeout`` (s) is how long it waits for an answer, ``name`` what others see of this client;
    an ``observer`` never keeps another program from owning the bench. Raises ConnectionLost when
    the owner does not take it.
    """
    connection = connect_to_owner(spec)
    if connection is None:
        return None
    return RemoteStation(connection, timeout, name=name, observer=observer)


class RemoteStation(Station):
    """Calls the owner for everything; its errors are raised here. A context manager.

    Each call is a sign of life. A move, step or homing that was ordered here ends by a ramp where
    none is made for :data:`~winchkit.bench.control.dead_man.LIFE_SIGN` (0.5 s): poll ``moving``.
    """

    _is_remote = True

    def __init__(
        self,
        connection: socket.socket,
        timeout: float = _ANSWER_TIME,
        *,
        name: str = "",
        observer: bool = False,
    ) -> None:
        """Take a place at the owner; raises ConnectionLost where it accepts no client."""
        self._requests = Requests(connection, timeout)
        try:
            reply = self._requests.call("introduce", name or client_name(), observer)
        except BaseException:
            self._requests.close()
            raise
        self.owner = str(reply["owner"])
        """Name of the process that owns the bench."""
        self.lends = bool(reply["lends"])
        """Whether the owner is a bench process, which ends with its last client."""
        self.digest = str(reply["digest"])
        """Of the files that the owner opened the bench with."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def hand_over(self) -> str:
        """Ask the owner to end for this client's sake; raises NotPermitted where it does not."""
        return str(self._requests.call("hand_over"))

    @property
    def clock(self) -> Clock:
        """Steady clock of this computer, which the bench process has too."""
        return MonotonicClock()

    def _request(self, operation: str, *arguments: Any, **named: Any) -> Any:
        timeout = None
        if operation == "cell":
            watched = sum(item for item in arguments if isinstance(item, float))
            timeout = _CELL_TIME + 3 * watched
        return self._requests.call(operation, *arguments, timeout=timeout, **named)

    def upload(self, winch: str | None, index: int, sub: int) -> bytes | None:
        """Bytes of an object of a drive.

        Parameters
        ----------
        winch : str or None
            Winch; None for the only one.
        index, sub : int
            Object of the drive.

        Returns
        -------
        bytes or None
            Its value, little-endian; None for an object that the drive lacks.
        """
        found = self.read_object(winch, index, sub)
        return None if found is None else bytes.fromhex(found)

    def scan(self) -> list[ScannedNode]:
        """Who is on the buses."""
        from winchkit.drivers.can.canopen.identity import Identity
        from winchkit.drivers.can.tools.scan import ScannedNode

        return [
            ScannedNode(**{**item, "identity": Identity(**item["identity"])})
            for item in self.scanned()
        ]

    def close(self) -> None:
        """Leave; returns when what was started here has ended and stands still.

        Raises MotionError where it does not come to rest. Twice does no harm.
        """
        try:
            if not self._requests.gone:
                self._requests.call("leave")
        except OwnerGone:
            pass  # it stops everything when it ends
        finally:
            self._requests.close()


class RemoteCells:
    """The instruments of a bench that another process owns."""

    def __init__(self, spec: BenchSpec, station: RemoteStation) -> None:
        self.spec, self._station = spec, station

    def do(self, task: str, name: str, *arguments: Any) -> dict[str, Any]:
        """One of :data:`~winchkit.bench.cells.tasks.TASKS`, done by the owner."""
        return self._station.cell(task, name, *arguments)


class OwnerGone(ConnectionLost):
    """The process that owned the bench has ended, or does not answer any more."""


class Requests:
    """One request after another over a socket, each with the answer of its number.

    ``timeout``: time to wait for an answer, s.
    """

    def __init__(self, connection: socket.socket, timeout: float) -> None:
        connection.settimeout(timeout)
        self._timeout = timeout
        self._connection = connection
        self._stream = connection.makefile("rwb")
        self._lock = threading.Lock()
        self._number = 0
        self.gone = False
        """Whether the owner has ended or the station was left."""

    def call(
        self,
        operation: str,
        *arguments: Any,
        timeout: float | None = None,
        since: float | None = None,
        **named: Any,
    ) -> Any:
        """The owner's answer to an operation.

        Raises the owner's error, OwnerGone, or UsageError for an argument that cannot be sent;
        another ``timeout`` (s) holds for this call. The owner refuses to move anything where too
        much time has passed since the call, or ``since`` an earlier time (s on the steady clock of
        this computer).
        """
        sent = time.monotonic() if since is None else since
        with self._lock:
            if self.gone:
                raise OwnerGone("this station at the bench was left; attach again")
            self._connection.settimeout(self._timeout if timeout is None else timeout)
            answer = self._exchange(operation, sent, arguments, named)
        if "error" in answer:
            raise error_of(answer["error"], answer["message"])
        return answer["ok"]

    def close(self) -> None:
        """Close the connection; twice does no harm."""
        with self._lock:
            self.gone = True
            with suppress(OSError):
                self._stream.close()
            self._connection.close()

    def _exchange(
        self, operation: str, sent: float, arguments: Sequence[Any], named: Mapping[str, Any]
    ) -> dict[str, Any]:
        """Send a request, and wait for the answer with its number; raises OwnerGone.

        Ctrl-C may interrupt it at any instruction. The answers to requests that were interrupted,
        whole or the rest of one, come before the one with the number, and are passed over.
        """
        self._number += 1
        number = self._number
        request = {
            "id": number,
            "op": operation,
            "sent": sent,
            "args": arguments,
            "named": named,
        }
        try:
            line = json.dumps(request, default=_plain).encode() + b"\n"
        except (TypeError, ValueError) as error:
            raise UsageError(f"{operation}: an argument cannot be sent: {error}") from None
        try:
            self._stream.write(line)
            self._stream.flush()
            while line := self._stream.readline():
                answer = _answer(line)
                if answer.get("id") == number:
                    return answer
        except ConnectionError:
            pass
        except (OSError, ValueError) as error:
            self.gone = True
            raise OwnerGone(f"the bench's owner does not answer: {error}") from error
        self.gone = True
        raise OwnerGone("the process that owned the bench has ended; its drives stop") from None


def _plain(value: object) -> float | dict[Any, Any]:
    """A number or mapping of another library, as JSON has it."""
    if isinstance(value, Real):
        return float(value)
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f"a {type(value).__name__} is no number and no text")


def _answer(line: bytes) -> dict[str, Any]:
    """An answer of the owner; empty for the rest of one whose beginning was lost."""
    try:
        answer = json.loads(line)
    except ValueError:
        return {}
    return answer if isinstance(answer, dict) else {}
