"""Detects a stuck (frozen) instrument by its raw counts.

Constant counts alone are no evidence: a good cell at rest shows the same number for minutes. They
are evidence where this instrument, in this state (at rest or moving), has never been constant for
so long before.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

_BLOCK = 40
"""Trials in a block. With a noise of one step a block alike throughout has a chance of 4e-16."""
_BLOCKS = 10
"""Noisy blocks, 400 trials, before constant counts are judged: an instrument that is quiet at times
shows it in them (rule of thumb)."""
_NOISE = 1.0
"""Steps of the counts; below it a value in the middle of a step may stand for ever.

A step is the smallest change that was ever seen: of an indicator with a division of 10 it is 10.
"""


@dataclass(slots=True)
class _State:
    """Statistics of the counts in one state, at rest or moving."""

    noisy: int = 0
    """Number of blocks, all of them noisy."""
    quiet: bool = False
    """Whether a block was ever constant and ended by itself."""
    step: float = math.inf
    """Smallest change of the counts."""
    squares: float = 0.0
    trials: float = 0.0

    def add(self, change: float, run: float) -> None:
        """Take a change of the counts after ``run`` equal trials."""
        self.step = min(self.step, abs(change))
        self.quiet |= run >= _BLOCK
        self.squares += change * change / 2
        self.trials += run
        if self.trials < _BLOCK:
            return
        if self.squares < (_NOISE * self.step) ** 2 * self.trials:
            self.quiet = True
        else:
            self.noisy += 1
        self.squares = self.trials = 0.0

    def too_long(self, run: float) -> bool:
        """Whether so many equal trials are too many for a live instrument."""
        return not self.quiet and self.noisy >= _BLOCKS and run >= _BLOCK


@dataclass(slots=True)
class FrozenDetector:
    """Detector of frozen counts; takes every count of one instrument."""

    _states: dict[bool, _State] = field(default_factory=lambda: {True: _State(), False: _State()})
    _last: float | None = None
    _run: float = 0.0
    _moving: bool = False

    def frozen(self, counts: float, conversions: float, moving: bool) -> bool:
        """Whether the counts are frozen, with the next ones, ``conversions`` after those before.

        Several readings of one conversion count as one trial, conversions that were not read not
        at all.
        """
        trial = min(1.0, conversions)
        if moving != self._moving:
            self._moving, self._run = moving, 0.0
        if self._last is None or counts != self._last:
            if self._last is not None:
                self._states[moving].add(counts - self._last, self._run + trial)
            self._last, self._run = counts, 0.0
            return False
        self._run += trial
        return self._states[moving].too_long(self._run)
