"""Times for which a jog lasts without a new command."""

from __future__ import annotations

__all__ = ["DEAD_MAN", "FIRST_PRESS"]

DEAD_MAN = 0.2
"""A jog ends this long after its last refresh, s."""
FIRST_PRESS = 0.7
"""Hold of the first press of a key, whose repeat starts late, s."""
