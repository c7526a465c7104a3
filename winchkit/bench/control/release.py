"""A held command (a key, a repeated jog) must be released after a stop before it counts again."""

from __future__ import annotations

from winchkit.bench.control.dead_man import RELEASE
from winchkit.errors import NotPermitted

__all__ = ["NotReleased", "ReleaseGuard"]


class NotReleased(NotPermitted):
    """A held command that was given before the last stop."""


class ReleaseGuard:
    """Distinguishes a new held command from one held already when everything stopped."""

    def __init__(self) -> None:
        """Begin without a stop."""
        self._asked: dict[str, float] = {}
        self._closed: set[str] = set()

    def close(self, winches: set[str]) -> None:
        """Require a release of these winches, which were stopped or reset."""
        self._closed |= winches

    def resume(self, start: float, ended: float) -> None:
        """What was held when a reset began (s) is held when it has ended, unless it is released.

        Whoever resets may be the one who holds, and asks for nothing meanwhile.
        """
        for winch, last in self._asked.items():
            if start - last < RELEASE:
                self._asked[winch] = max(last, ended)

    def ask(self, winch: str, now: float) -> None:
        """Note a request at ``now`` (s); raises NotReleased where a release has to come first."""
        last = self._asked.get(winch)
        self._asked[winch] = now
        if winch not in self._closed:
            return
        if last is not None and now - last < RELEASE:
            raise NotReleased(
                f"winch {winch} was stopped or reset while this command was held; release it for "
                f"{RELEASE:g} s before moving the winch again"
            )
        self._closed.discard(winch)
