"""Whether the numbers of a device make sense beside its status, before any of them is believed.

Words in the wrong order make huge, tiny or jumping numbers, of which a few look sound by chance.
One that contradicts its status therefore spoils those after it, and floats, of which one in six
passes by chance, are believed only after several that made sense. Integers near zero make numbers
that are merely large: where both orders are possible the smaller number is believed, the larger
one only once a reading has told that the order is right.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Consistency"]

_AFTER_CONTRADICTION = 20
_FLOATS_AT_FIRST = 5
_DOUBTFUL_AT_MOST = 5


@dataclass(slots=True)
class Consistency:
    """Counts readings in good order."""

    floats: bool
    order_known: bool = False
    """Whether a reading has told that the order is right."""
    _doubtful: int = 0
    _wanting: int = 0
    _contradicted: bool = False
    _begun: bool = False

    def take(self, sound: bool, order: bool | None) -> bool | None:
        """Take in the next reading: True to believe it, False not to, None to wait in silence.

        ``order`` is True where only this order makes a possible number, False where the other one
        makes a smaller number, None where nothing is told.
        """
        self.order_known |= sound and order is True
        if order is False and not self.order_known:
            self._doubtful += 1
            if self._doubtful <= _DOUBTFUL_AT_MOST:
                return None
            sound = False
        if not self._begun:
            self._begun, self._wanting = True, _FLOATS_AT_FIRST if self.floats else 0
        if not sound:
            self._wanting, self._contradicted = _AFTER_CONTRADICTION, True
        elif self._wanting:
            self._wanting -= 1
        if not self._wanting:
            self._contradicted = False
            return True
        return False if self._contradicted else None
