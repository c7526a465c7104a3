"""Single keys from a terminal, and how long a held key keeps a winch moving."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Protocol

from winchkit.bench.dead_man import DEAD_MAN, FIRST_PRESS
from winchkit.bench.remote.interruption import Terminated

__all__ = ["HeldKey", "Keys", "open_keys"]

_ARROWS = {"\x1b[A": "up", "\x1b[B": "down", "\x1bOA": "up", "\x1bOB": "down"}
_WINDOWS_ARROWS = {"H": "up", "P": "down"}
_POLL = 0.01


class Keys(Protocol):
    """A keyboard."""

    def read(self, timeout: float) -> list[str]:
        """Keys pressed within ``timeout`` s, oldest first; arrows as ``up`` and ``down``."""


class HeldKey:
    """Tells a key that is held, and repeats, from one that was pressed once.

    A terminal shows no release: the first press holds for longer, since repeats start late, and
    each repeat for as long as a dead-man may.
    """

    def __init__(self) -> None:
        self._key = ""
        self._until = float("-inf")

    def hold(self, key: str, now: float) -> float:
        """How long (s) the motion of this press may last without another."""
        repeated = key == self._key and now < self._until
        duration = DEAD_MAN if repeated else FIRST_PRESS
        self._key, self._until = key, now + duration
        return duration


@contextmanager
def open_keys() -> Iterator[Keys]:
    """Read single keys from the terminal; its settings are restored at the end."""
    if sys.platform == "win32":
        yield _WindowsKeys()
        return
    import termios
    import tty

    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)
    try:
        tty.setcbreak(descriptor)
        yield _PosixKeys(descriptor)
    finally:
        with suppress(termios.error):  # a terminal that was closed has no settings
            termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


class _PosixKeys:
    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor

    def read(self, timeout: float) -> list[str]:
        """Keys pressed within ``timeout`` s."""
        import select

        ready, _, _ = select.select([self._descriptor], [], [], timeout)
        if not ready:
            return []
        try:
            typed = os.read(self._descriptor, 256).decode(errors="replace")
        except OSError:  # the terminal was closed
            typed = ""
        if not typed:
            raise Terminated
        return split_keys(typed)


class _WindowsKeys:
    def read(self, timeout: float) -> list[str]:
        """Keys pressed within ``timeout`` s."""
        if sys.platform != "win32":
            return []
        import msvcrt

        end = time.monotonic() + timeout
        while not msvcrt.kbhit():
            if time.monotonic() >= end:
                return []
            time.sleep(_POLL)
        keys = []
        while msvcrt.kbhit():
            char = msvcrt.getwch()
            keys.append(_WINDOWS_ARROWS.get(msvcrt.getwch(), "") if char in "\x00\xe0" else char)
        return [key for key in keys if key]


def split_keys(text: str) -> list[str]:
    """Keys of what a terminal sent at once, e.g. ``"\\x1b[A\\x1b[A "``."""
    keys = []
    while text:
        arrow = next((code for code in _ARROWS if text.startswith(code)), None)
        keys.append(_ARROWS[arrow] if arrow else text[0])
        text = text[len(arrow) if arrow else 1 :]
    return keys
