"""Transaction numbers of Modbus TCP requests that the next answers are unlikely to hold.

An answer whose registers hold the beginning of another frame's head is taken for two joined frames
(``tcp_frames``). A register that changes while the numbers are counted would meet them again and
again; so the numbers stay away from the bytes of the last answers. The numbers of one high byte
are a page; a page is used while no two bytes of a last answer begin with its high byte or with one
close to it.
"""

from __future__ import annotations

LAST = 65_000
"""The library begins again at 1 after it."""
_SIZE = 256
"""Numbers with the same upper byte."""
_PAGES = LAST // _SIZE
_MARGIN = 4
"""Pages on each side. A register that changes by more than 1024 while a number is remembered passes
it between two readings, and equals it by chance only."""
_ENOUGH = 64
"""Pages that are left at least, so that a number is used again after 16,000 requests or more: with
many devices on a line the margin is smaller."""


class Transactions:
    """Chooses the transaction number of each request."""

    def __init__(self) -> None:
        self._begin: dict[bytes, bytes] = {}
        """First bytes of every two bytes of the last answer to each block."""
        self._held = [0] * _SIZE
        """How many of them there are, by their value."""
        self._margin = _MARGIN

    def note(self, block: bytes, data: bytes) -> None:
        """Keep what the newest answer holds behind unit and function."""
        for first in self._begin.get(block, b""):
            self._held[first] -= 1
        self._begin[block] = data[:-1]
        for first in data[:-1]:
            self._held[first] += 1

    def after(self, number: int) -> int:
        """The number to use after ``number``.

        None ends with a zero byte: the lower byte of a register, which changes at once, may stand
        before a register of zero.
        """
        number = number % LAST + 1
        page = number // _SIZE
        if number % _SIZE and page < _PAGES and self._is_free(page, self._margin):
            return number
        for self._margin in range(_MARGIN, -2, -1):
            free = [one for one in range(_PAGES) if self._is_free(one, self._margin)]
            if len(free) >= _ENOUGH:
                break
        following = next((one for one in free if one >= page), free[0])
        return max(number, page * _SIZE + 1) if following == page else following * _SIZE + 1

    def _is_free(self, page: int, margin: int) -> bool:
        """Whether no answer holds the beginning of a number so close to a page."""
        near = range(page - margin, page + margin + 1)
        return not any(self._held[one % _SIZE] for one in near)
