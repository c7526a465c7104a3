"""Replies that are still outstanding, and what must not be taken for the answer because of them.

A Modbus RTU reply does not name its request: a reply that comes after its time-out has the form of
the answer to the next request of the same length. Every request that was not answered is therefore
remembered until no reply to it can come any more, and until then

- the unit is left alone for the device's longest reply time after the time-out,
- no request is sent whose answer would have the length of an outstanding one, and of three requests
  in a row for the same block no two have the same length, so that the length identifies a reply: a
  copy of an answer that a line hands over two requests later is not taken for a new one,
- where the device answers one length only (or every length is outstanding) nothing is asked until
  the horizon, and the first exchange after it is discarded: its reading is NaN and ``ambiguous``.

Over TCP the transaction identifies a reply. There the same is done against a gateway that takes
the late reply of its serial line for the answer to its next query. Replies that came while nothing
was asked wait in such a gateway, one for each later query: after the horizon as many exchanges are
discarded as replies were outstanding. A device of one length is left alone for the longest reply
time only.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from winchkit.drivers.reading import REPLY_HORIZON
from winchkit.schema.devices.modbus import ReadBlock

LISTENING = 4e-3
"""Longer than a frame and the silence after it take at any usual baud rate, s."""
_REMEMBERED = 3.0
"""So much longer the length of an outstanding reply is avoided while others are free, s."""
_MOST_LONGER = 7
"""Registers by which a request is made longer at most: 14 bytes, 15 ms at 9600 Bd."""


@dataclass(slots=True)
class LateReplies:
    """The outstanding replies of one unit; times on the bench's clock, s."""

    longest_reply: float
    max_registers: int = 125
    tagged: bool = False
    """Whether a reply names its request (TCP)."""
    until: float = 0.0
    """Until then the unit is not asked."""
    ambiguous: int = 0
    """Readings to be discarded: their answers may belong to earlier requests."""
    _missing: list[tuple[int, float]] = field(default_factory=list)
    """Registers of each reply that is outstanding, and when it cannot come any more."""
    _longest: dict[int, int] = field(default_factory=dict)
    """Most registers that the device answers from a start address, as far as is known."""
    _answered: dict[int, int] = field(default_factory=dict)
    """Most registers that the device did answer from a start address."""
    _last: dict[int, tuple[int, ...]] = field(default_factory=dict)
    """Registers of the two newest requests by start address, the newest one last."""

    def clear(self) -> None:
        """Nothing old can come any more."""
        self.until, self.ambiguous = 0.0, 0
        self._missing.clear()

    def count(self, block: ReadBlock, now: float) -> int:
        """How many registers to ask for, so that the answer is no other's; 0 for not now."""
        lengths = self._lengths(block)
        self._missing = [one for one in self._missing if one[1] + _REMEMBERED > now]
        # A length that was not outstanding lately, else one whose reply cannot come any more.
        recent = {count for count, _ in self._missing}
        taken = {count for count, until in self._missing if until > now}
        free = [count for count in lengths if count not in recent]
        free = free or [count for count in lengths if count not in taken]
        if not free:
            ends = [until for count, until in self._missing if count in lengths and until > now]
            if self.tagged and len(lengths) == 1:
                silent_until = max(ends) - (REPLY_HORIZON - 1) * self.longest_reply
                if now < silent_until:
                    self.until = silent_until
                    return 0
                free = list(lengths)
            else:
                self.until = min(ends)
                self.ambiguous = len(ends) if self.tagged else 1
                return 0
        last = self._last.get(block.start, ())
        # The length that was used longest ago, if ever.
        chosen = min(free, key=lambda count: last.index(count) + 1 if count in last else 0)
        self._last[block.start] = (*last[-1:], chosen)
        return chosen

    def alike(self, block: ReadBlock) -> bool:
        """Whether two answers in a row cannot be distinguished."""
        return not self.tagged and len(self._lengths(block)) == 1

    def answered(self, block: ReadBlock, count: int) -> None:
        """The answer came."""
        self._answered[block.start] = max(count, self._answered.get(block.start, 0))

    @property
    def outstanding(self) -> bool:
        """Whether a reply may still come."""
        return bool(self._missing)

    def unanswered(self, count: int, now: float) -> None:
        """No answer of ``count`` registers came in time (0: to a write)."""
        self.until = max(self.until, now if self.tagged else now + self.longest_reply)
        if count:
            self._missing.append((count, now + REPLY_HORIZON * self.longest_reply))

    def came(self, count: int, now: float) -> None:
        """A reply of ``count`` registers came that was not the answer."""
        at = next((k for k, one in enumerate(self._missing) if one[0] == count), None)
        if at is not None:
            del self._missing[at]
        if not self.tagged:
            # There may be more of them.
            self.until = max(self.until, now + self.longest_reply)

    def refused(self, block: ReadBlock, count: int, now: float) -> bool:
        """The device refused a length; whether a shorter one is left to be tried."""
        if self._missing:
            # The refusal may be the late reply, and the answer still to come.
            self.unanswered(count, now)
        if count <= max(block.count, self._answered.get(block.start, 0)):
            return False
        self._longest[block.start] = count - 1
        return True

    def silent(self, now: float) -> bool:
        """Whether the unit is not to be asked now."""
        return now < self.until

    def discards(self) -> bool:
        """Whether the reading that was just taken is discarded."""
        discarded = self.ambiguous > 0
        self.ambiguous -= discarded
        return discarded

    def _lengths(self, block: ReadBlock) -> range:
        if block.fixed:
            return range(block.count, block.count + 1)
        most = min(self.max_registers, block.count + _MOST_LONGER)
        return range(block.count, min(most, self._longest.get(block.start, most)) + 1)
