"""Permission to move: an unbroken chain of refreshes by the client that commands the motion.

Each refresh must come before the permission that the one before it gave has expired. What has
expired is never refreshed: a new motion needs a new command. So no client that stood still goes on
by itself, whatever it sends afterwards.
"""

from __future__ import annotations

from winchkit.errors import MotionError, NotPermitted

DEAD_MAN = 0.2
"""A jog ends this long after its last refresh, s."""
REFRESH = 0.05
"""Between two refreshes, s: four within `DEAD_MAN`, so that a late one does not stop the winch."""
FIRST_PRESS = 0.7
"""Hold of the first press of a key, whose repeat starts late, s."""
LIFE_SIGN = 0.5
"""A move, step or homing of another process ends this long after that process's last request, s:
ten requests of a command, which sends one each `REFRESH`."""


class DeadMan:
    """Permission to move until a time, which can be extended before it and not after it."""

    def __init__(self, expires: float) -> None:
        """Permit until ``expires`` (s on the bench's clock)."""
        self._expires = expires
        self._over = False
        self._why = ""

    def live(self, now: float) -> bool:
        """Whether the motion may go on at ``now`` (s); once it may not, it never may again."""
        if now >= self._expires:
            self._over = True
        return not self._over

    def refresh(self, now: float, expires: float) -> None:
        """Extend it to ``expires`` (s); raises MotionError where it has expired, or was ended."""
        if not self.live(now):
            raise MotionError(self._why or self._late(now))
        self._expires = expires

    def end(self, why: str) -> None:
        """End it now, for a reason in words."""
        self._why, self._over = why, True

    def _late(self, now: float) -> str:
        return (
            f"the refresh came {now - self._expires:.2f} s after the dead-man had ended the motion "
            "(its client was suspended, or too slow); nothing moves before a new command"
        )


def remaining(duration: float, age: float) -> float:
    """What is left of a permission of ``duration`` s that was asked for ``age`` s ago, s."""
    if not age < duration:
        raise NotPermitted(
            f"this command was {age:.2f} s on its way, the limit is {duration:.2g} s (a process "
            "was suspended, or the computer is too slow); nothing was moved, give it again"
        )
    return duration - max(0.0, age)
