"""Consistency of a device's values with its status, before any value is accepted.

Words in the wrong order give very large, very small or jumping values; one float in six of them is
plausible by chance. A value that contradicts the status therefore also invalidates those after it,
and floats are accepted only after several consistent readings. Integers near zero give large values
in the wrong order: where both orders are possible the smaller value is accepted, and the larger one
only after a reading has shown that the order is right.
"""

from __future__ import annotations

from dataclasses import dataclass

_AFTER_CONTRADICTION = 20
"""Consistent readings in a row that are required after a contradiction."""
_FLOATS_AT_FIRST = 5
"""Consistent readings in a row that are required of floats at the start: by chance in 1 of 7800."""
_UNDECIDED_AT_MOST = 5
"""Readings of undecided order without a result; the next ones are flagged."""


@dataclass(slots=True)
class Consistency:
    """Counts consistent readings."""

    floats: bool
    order_known: bool = False
    """Whether a reading has shown that the order is right."""
    _undecided: int = 0
    _required: int = 0
    _contradicted: bool = False
    _started: bool = False

    def take(self, sound: bool, order: bool | None) -> bool | None:
        """Evaluate the next reading.

        ``order``: True where only this word order gives a possible value, False where the other one
        gives a smaller value, None where both are alike. Returns: True: the value is accepted;
        False: it is flagged; None: not decided yet, no reading.
        """
        self.order_known |= sound and order is True
        if order is False and not self.order_known:
            self._undecided += 1
            if self._undecided <= _UNDECIDED_AT_MOST:
                return None
            sound = False
        if not self._started:
            self._started, self._required = True, _FLOATS_AT_FIRST if self.floats else 0
        if not sound:
            self._required, self._contradicted = _AFTER_CONTRADICTION, True
        elif self._required:
            self._required -= 1
        if not self._required:
            self._contradicted = False
            return True
        return False if self._contradicted else None
