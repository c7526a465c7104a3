"""Unwraps the position counter 6064h: any number of turns, both ways, from a counter that ends.

After its highest value a counter goes on at its lowest. Two successive values that differ by more
than half the range have crossed the end, as long as the motor cannot turn half the range between
them; after a longer gap the number of crossings is unknown. So is the position once two values
differ by more than the motor can turn between them: the counter was set, or its encoder fails.
"""

from __future__ import annotations

from math import inf

from winchkit.errors import NotPermitted

_DELAY = 0.25
"""By which a value may be older than the SYNC that it answers, s: a drive or a computer that stands
still for longer is missed by its heartbeat."""


class PositionCounter:
    """One drive's counter; ``low`` to ``high`` are the counts that it can show."""

    __slots__ = (
        "_fastest", "_kept", "_step", "doubt", "gap", "half", "high", "jump", "last", "low",
        "offset", "span", "time", "zero",
    )  # fmt: skip

    def __init__(self, low: int, high: int, fastest: float = 0.0) -> None:
        """Take the range, and the greatest speed of the motor in counts/s (0: not known)."""
        self.low, self.high = low, high
        self.span = high - low + 1
        self.half: float = self.span // 2
        self.gap = self.half / fastest if fastest > 0 else inf
        """After this long without feedback the crossings are unknown, s."""
        self._fastest = fastest if fastest > 0 else inf
        self._step = min(self.half, self._fastest * _DELAY)
        self.last: float = inf
        """Newest count as the drive shows it; infinite before the first."""
        self.time = -inf
        self.offset = 0
        """Whole ranges that were crossed, in counts: to be added to what the drive shows."""
        self.zero = 0
        """Of a drive that keeps none itself, in counts: to be added too."""
        self.doubt = ""
        """Why the position is not known, in words; empty while it is."""
        self.jump = 0.0
        """Change between two successive values that no motion explains, in counts; 0 for none."""
        self._kept: tuple[int, int, str] | None = None

    def take(self, count: int, time: float) -> int:
        """Take a count of the drive and the time of its sampling (s); returns it unwrapped."""
        change = count - self.last
        if abs(change) > self._step:
            self._far(change, time)
        if time - self.time > self.gap and self.time > -inf:
            self.lose("6064h may have wrapped while nothing was heard of the drive")
        self.last, self.time = count, time
        return count + self.offset + self.zero

    def _far(self, change: float, time: float) -> None:
        """Count a crossing of the counter's end, or note a jump; the first value of all is none."""
        if change in (inf, -inf):
            return
        if abs(change) > self.half:
            turned = -self.span if change > 0 else self.span
            self.offset += turned
            change += turned
        if abs(change) > self._fastest * (time - self.time + _DELAY):
            self.jump = change
            self.lose("6064h has jumped")

    def lose(self, doubt: str) -> None:
        """The position is not known from now on, until a homing; the first reason stands."""
        self.doubt = self.doubt or doubt

    @property
    def settled(self) -> bool:
        """Whether no homing is under way, which may move the zero or fail."""
        return self._kept is None

    def restart(self, doubt: str) -> None:
        """Begin anew with a drive that has restarted; ``doubt`` says what became of its count."""
        if doubt or self.offset:
            self.lose(doubt or "6064h had wrapped before the drive restarted")
        self.offset, self.last, self.time = 0, inf, -inf

    def suspend(self) -> None:
        """Take the drive's counts as they are: while it homes, they jump to the new zero."""
        self._kept = (self.offset, self.zero, self.doubt)
        self.offset, self.zero, self.half, self.doubt = 0, 0, inf, ""
        self._step = inf

    def resume(self, zero: str | None) -> None:
        """Unwrap again: from where it was, or from a new zero and a doubt of it (empty: none)."""
        self.half = self.span // 2
        self._step = min(self.half, self._fastest * _DELAY)
        if zero is not None:
            self.doubt = zero
        elif self._kept is not None:
            self.offset, self.zero, self.doubt = self._kept
        self._kept = None

    def define(self, position: int) -> None:
        """Let the present count be ``position``."""
        self.offset, self.zero, self.doubt = 0, position - int(self.last), ""

    def target(self, counts: int, name: str) -> int:
        """Counter value for an unwrapped target; raises NotPermitted beyond its end.

        No drive is sent across the end of its counter: whether it then takes the short way or the
        long one is proved by nothing that it declares.
        """
        shown = counts - self.offset - self.zero
        if not self.low <= shown <= self.high:
            raise NotPermitted(
                f"{name}: a target position of {shown} counts is beyond the end of the drive's "
                f"counter, {self.low} to {self.high}; move in a velocity mode (motion_mode), or "
                "set the drive's zero nearer"
            )
        return shown
