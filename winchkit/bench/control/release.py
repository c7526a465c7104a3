"""A held command (a key, a repeated jog) must be released after a stop before it counts again."""

from __future__ import annotations

import threading
from collections.abc import Collection, Hashable

from winchkit.bench.control.dead_man import RELEASE
from winchkit.errors import NotPermitted

__all__ = ["NotReleased", "ReleaseGuard"]


class NotReleased(NotPermitted):
    """A held command that was given before the last stop."""


class ReleaseGuard:
    """Distinguishes a new held command from one held already when everything stopped.

    Whoever holds is a client: a command that is started anew is another one, which holds nothing.
    """

    def __init__(self) -> None:
        """Begin without a stop."""
        self._asked: dict[tuple[str, Hashable], float] = {}
        self._closed: set[tuple[str, Hashable]] = set()
        self._lock = threading.RLock()

    def close(self, winches: Collection[str]) -> None:
        """Require a release of these winches, which were stopped or reset, by who holds them."""
        with self._lock:
            self._closed |= {key for key in self._asked if key[0] in winches}

    def resume(self, start: float, ended: float) -> None:
        """What was held when a reset began (s) is held when it has ended, unless it is released.

        Whoever resets may be the one who holds, and asks for nothing meanwhile.
        """
        with self._lock:
            for key, last in self._asked.items():
                if start - last < RELEASE:
                    self._asked[key] = max(last, ended)

    def ask(self, winch: str, client: Hashable, now: float) -> None:
        """Note a request at ``now`` (s); raises NotReleased where a release has to come first."""
        key = (winch, client)
        with self._lock:
            self._asked = {one: last for one, last in self._asked.items() if now - last < RELEASE}
            self._closed &= self._asked.keys()
            self._asked[key] = now
            held = key in self._closed
        if held:
            raise NotReleased(
                f"winch {winch} was stopped or reset while this command was held; release it for "
                f"{RELEASE:g} s before moving the winch again"
            )
