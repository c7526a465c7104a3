"""The EMCY producer of CiA 301: error register 1001h, history 1003h, COB-ID 1014h."""

from __future__ import annotations

from collections.abc import Callable

from slave.dictionary import Dictionary
from slave.frames import Frame

_GENERIC = 0x01
_BITS = {0x2: 0x02, 0x3: 0x04, 0x4: 0x08, 0x8: 0x10}
"""Bits of 1001h by the first digit of a code."""


class Emergencies:
    """Sends EMCY messages and remembers the errors that stand."""

    def __init__(self, node: int, objects: Dictionary, send: Callable[[Frame], None]) -> None:
        self._node, self._objects, self._send = node, objects, send
        self.standing: set[int] = set()
        self.register = 0

    def report(self, code: int, register: int = _GENERIC) -> None:
        """Send a code; it stands until :meth:`clear`."""
        self.standing.add(code)
        self.register |= register | _GENERIC | _BITS.get(code >> 12, 0)
        self._remember(code)
        self._transmit(code)

    def clear(self) -> None:
        """Error reset: EMCY 0000h."""
        if self.standing:
            self.standing.clear()
            self.register = 0
            self._objects.set(0x1001, 0, 0)
            self._transmit(0)

    def forget(self) -> None:
        """As after power-on; nothing is sent."""
        self.standing.clear()
        self.register = 0

    def _remember(self, code: int) -> None:
        """The newest error stands at 1003h:1."""
        objects = self._objects
        objects.set(0x1001, 0, self.register)
        count = objects.get(0x1003)
        for sub in range(min(count, 7), 0, -1):
            objects.set(0x1003, sub + 1, objects.get(0x1003, sub))
        objects.set(0x1003, 1, code)
        last = sum(1 for index, sub in objects.entries if index == 0x1003 and sub)
        objects.set(0x1003, 0, min(count + 1, last))

    def _transmit(self, code: int) -> None:
        cob = self._objects.get(0x1014, 0, 0x80 + self._node)
        if not cob & 1 << 31:
            data = code.to_bytes(2, "little") + bytes((self.register,)) + bytes(5)
            self._send(Frame((cob & 0x7FF) or 0x80 + self._node, data))
