"""Clients of a bench: the name of each, and the time since its newest request (life sign)."""

from __future__ import annotations

import getpass
import os
import sys
from dataclasses import dataclass
from pathlib import Path

_STEP = 0.05
"""Of silence that one cycle adds at most, s: a standstill of this process is not the client's."""


class LifeSign:
    """Of one client in another process; heard in one thread, counted in another."""

    def __init__(self) -> None:
        self.silence = 0.0
        """Since the newest request, s."""
        self._requests = self._counted = 0

    def heard(self) -> None:
        """The client has sent something."""
        self._requests += 1

    def pass_by(self, duration: float) -> None:
        """A cycle has passed, of ``duration`` s."""
        if self._requests != self._counted:
            self._counted, self.silence = self._requests, 0.0
        else:
            self.silence += min(duration, _STEP)


@dataclass(frozen=True, eq=False)
class Client:
    """Somebody who orders motion; two clients of one name are still two."""

    name: str
    observer: bool = False
    """Whether it only looks on, as ``monitor`` and ``log`` do."""
    life: LifeSign | None = None
    """Of a client in another process; None in the process that owns the bench."""

    def heard(self) -> None:
        """It has sent a request, or given an order."""
        if self.life is not None:
            self.life.heard()


def client_name(what: str | None = None) -> str:
    """This process in words, e.g. ``jog (process 4711, user x)``."""
    try:
        user = getpass.getuser()
    except (KeyError, OSError):
        user = "unknown"
    program = what or Path(sys.argv[0] or "python").name or "python"
    return f"{program} (process {os.getpid()}, user {user})"
