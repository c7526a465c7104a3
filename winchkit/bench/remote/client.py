"""A station at a bench that another process owns: its requests to the owner, and their answers."""

from __future__ import annotations

import socket
from typing import TYPE_CHECKING, Any, Self

from winchkit.bench.ownership import connect_to_owner
from winchkit.bench.remote.identity import client_name
from winchkit.bench.remote.operations import Station
from winchkit.bench.remote.requests import ANSWER_TIME, OwnerGone, Requests
from winchkit.drivers.clock import Clock, MonotonicClock
from winchkit.schema.bench import BenchSpec

if TYPE_CHECKING:
    from winchkit.drivers.can.tools.scan import ScannedNode

_CELL_TIME = 20.0
"""Longer than any command to an instrument with the readings before and after it, s."""


def attach(
    spec: BenchSpec,
    timeout: float = ANSWER_TIME,
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
        timeout: float = ANSWER_TIME,
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
