"""When an answer must not be believed, because it may belong to a request before.

A Modbus RTU answer does not say which request it answers. After a timeout the unit is left alone
until a late answer has had its time. Where all its answers are alike in length, one exchange more
is thrown away, and the time after it watched for an answer too many.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["LISTENING", "Distrust"]

LISTENING = 4e-3
"""Longer than a frame and the silence after it take at any usual baud rate, s."""

_LONGEST_REPLIES = 3
"""No answer later than this many times its declared longest is ever taken for another."""


@dataclass(slots=True)
class Distrust:
    """The state of one unit; times on the bench's clock, s."""

    longest_reply: float
    timeout: float
    until: float = 0.0
    """Until then the unit is not asked."""
    _discard: bool = False

    @property
    def silence(self) -> float:
        """How long a unit is left alone, s."""
        return max(self.longest_reply, _LONGEST_REPLIES * self.longest_reply - self.timeout)

    def clear(self) -> None:
        """Nothing old can come any more."""
        self.until, self._discard = 0.0, False

    def unanswered(self, now: float) -> None:
        """A request was not answered in time."""
        self.until, self._discard = now + self.silence, True

    def answered(self, now: float, *, fixed: bool) -> None:
        """An answer was taken: where all are alike, listen for a second one before asking again."""
        if fixed:
            self.until = max(self.until, now + LISTENING)

    def late(self, now: float) -> None:
        """An answer came that nobody waited for; there may be more of them."""
        self.unanswered(now)

    def silent(self, now: float) -> bool:
        """Whether the unit is not to be asked now."""
        return now < self.until

    def discards(self, now: float, *, fixed: bool) -> bool:
        """Whether the answer that has just come is thrown away.

        With alternating lengths (not ``fixed``) an old answer is refused by its length.
        """
        if not (self._discard and fixed):
            self._discard = False
            return False
        self.until, self._discard = now + self.silence, False
        return True
