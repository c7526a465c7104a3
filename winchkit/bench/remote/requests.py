"""Requests of a client to the process that owns the bench, and the answers by their numbers."""

from __future__ import annotations

import json
import socket
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from numbers import Real
from typing import Any

from winchkit.errors import ConnectionLost, UsageError, error_of

ANSWER_TIME = 10.0
"""s: longer than the longest answer without a motion, a reset of several drives (some seconds)."""


class OwnerGone(ConnectionLost):
    """The process that owned the bench has ended, or does not answer any more."""


class Requests:
    """One request after another over a socket, each with the answer of its number."""

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
