"""Times after which a motion ends unless the client that commands it sends a sign of life."""

from __future__ import annotations

__all__ = ["DEAD_MAN", "FIRST_PRESS", "LIFE_SIGN", "REFRESH", "RELEASE"]

DEAD_MAN = 0.2
"""A jog ends this long after its last refresh, s."""
REFRESH = 0.05
"""Between two refreshes, s: four within `DEAD_MAN`, so that a late one does not stop the winch."""
FIRST_PRESS = 0.7
"""Hold of the first press of a key, whose repeat starts late, s."""
RELEASE = FIRST_PRESS + 0.1
"""Without a request for this long a held command was released, s: a key that is pressed anew
repeats only after its first delay, which must not count as a release."""
LIFE_SIGN = 0.5
"""A move, step or homing of another process ends this long after that process's last request, s:
ten requests of a command, which sends one each `REFRESH`."""
