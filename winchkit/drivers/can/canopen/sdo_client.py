"""An SDO client of the canopen library that waits for its replies on the bench's clock."""

from __future__ import annotations

from typing import Any

import canopen
from canopen.sdo import client as library

from winchkit.drivers.clock import Clock
from winchkit.drivers.scheduling import event_of

_SdoClient: Any = library.SdoClient
_OBJECT = slice(1, 4)
"""Bytes of an SDO frame with index and sub-index (CiA 301)."""
_STOPS = (b"\x40\x60\x00", b"\x41\x60\x00")
"""6040h and 6041h: stops by SDO ask for these too, beside this client; two answers say nothing."""
_REPLIES = {1: (3, 4), 2: (2, 4)}
"""Server's command specifiers that answer the client's: initiate download, upload; 4 is abort."""


def sdo_client(remote: canopen.RemoteNode, clock: Clock) -> Any:
    """Replace the SDO client of a node on a network by one that waits on a clock."""
    plain = remote.sdo
    remote.network.unsubscribe(plain.tx_cobid, plain.on_response)
    client = _WaitingSdoClient(plain.rx_cobid, plain.tx_cobid, remote.object_dictionary, clock)
    client.network = remote.network
    remote.sdo, remote.sdo_channels = client, [client]
    remote.network.subscribe(client.tx_cobid, client.on_response)
    return client


class _WaitingSdoClient(_SdoClient):  # type: ignore[misc]
    def __init__(self, request: int, reply: int, dictionary: Any, clock: Clock) -> None:
        super().__init__(request, reply, dictionary)
        self._arrived = event_of(clock)
        self._open = self._answered = b""
        """Index and sub-index of the request under way, and of the one answered last."""
        self._replies: tuple[int, ...] = ()
        """Command specifiers of its answer; none where any answers, such as a segment."""
        self.answered_twice = 0
        """Answers to a request that was answered: of a second node, or to another client."""

    def send_request(self, request: Any) -> None:
        self._arrived.clear()
        self._open, self._replies = bytes(request[_OBJECT]), _REPLIES.get(request[0] >> 5, ())
        super().send_request(request)

    def on_response(self, can_id: int, data: Any, timestamp: float) -> None:
        answer, replies = bytes(data[_OBJECT]), self._replies
        # A late answer to a stop by SDO, or one to another client, answers nothing of this one.
        other = bool(replies) and (answer != self._open or data[0] >> 5 not in replies)
        if answer == self._open and not other:
            self._open, self._answered, self._replies = b"", answer, ()
        elif answer == self._answered and answer not in _STOPS:
            self.answered_twice += 1
        if other:
            return
        super().on_response(can_id, data, timestamp)
        self._arrived.set()

    def read_response(self) -> Any:
        if not self._arrived.wait(self.RESPONSE_TIMEOUT):
            raise canopen.SdoCommunicationError("No SDO response received")
        return super().read_response()
