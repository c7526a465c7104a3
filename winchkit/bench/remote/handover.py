"""Owning a bench: at once where it is free, else handed over by a bench process that may."""

from __future__ import annotations

import time
from contextlib import closing, suppress

from winchkit.bench.ownership import Ownership, connect_to_owner, owner_name
from winchkit.bench.remote.requests import ANSWER_TIME, Requests
from winchkit.errors import ConnectionLost, NotPermitted
from winchkit.schema.bench import BenchSpec

_TIMEOUT = 10.0
"""For a bench process to disable its drives and end, s."""
_CLOSING = 2.0
"""For an owner that accepts no client any more, s."""
_OPENING = 8.0
"""For an owner that is opening the bench, s."""
_POLL = 0.02
"""s: not noticed by an operator."""


def own(spec: BenchSpec, name: str) -> Ownership:
    """Own a bench as ``name``.

    Raises NotPermitted, naming the owner and who uses the bench, where it is not handed over.
    """
    asked = False
    deadline = time.monotonic() + _CLOSING
    while True:
        try:
            return Ownership(spec, name)
        except NotPermitted:
            if time.monotonic() > deadline:
                raise
        if not asked and _hand_over(spec, name):
            asked, deadline = True, time.monotonic() + _TIMEOUT
        time.sleep(_POLL)


def own_or_find(spec: BenchSpec, name: str) -> Ownership | None:
    """Own a bench as ``name``; None where another process owns it and accepts clients.

    Raises NotPermitted, naming the owner, where it accepts no client.
    """
    deadline = time.monotonic() + _OPENING
    while True:
        try:
            return Ownership(spec, name)
        except NotPermitted:
            if time.monotonic() > deadline:
                raise NotPermitted(
                    f"bench '{spec.name}' is owned by {owner_name(spec)}, which has accepted no "
                    f"client for {_OPENING:g} s: it still opens the bench, or works on its cells "
                    "alone; wait for it, or end it"
                ) from None
        with suppress(ConnectionLost):
            connection = connect_to_owner(spec)
            if connection is not None:
                connection.close()
                return None
        time.sleep(_POLL)


def _hand_over(spec: BenchSpec, name: str) -> bool:
    """Ask the owner for the bench; whether it gives it. Raises NotPermitted where it refuses."""
    try:
        connection = connect_to_owner(spec)
        if connection is None:
            return False
        with closing(Requests(connection, ANSWER_TIME)) as requests:
            requests.call("introduce", name, False)
            requests.call("hand_over")
    except ConnectionLost:
        return False
    return True
