"""SIGTERM, SIGHUP and Ctrl-C as one exception, so that each of them stops in the same way.

For programs that own their process (the command line, the bench process); a library installs no
signal handlers. SIGHUP comes when the terminal of a process is closed.
"""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP")
_ENDING = 10.0
"""Time to come to rest, s: signals that repeat the first one within it change nothing."""
_SIGNAL_EXIT = 128
"""Exit code of a process that signal n ended: 128 + n (POSIX shells)."""


class Terminated(KeyboardInterrupt):
    """SIGTERM, SIGHUP or a closed terminal; what ends at Ctrl-C ends at it in the same way."""

    def __init__(self, number: int = getattr(signal, "SIGHUP", signal.SIGTERM)) -> None:
        super().__init__()
        self.number = int(number)
        """Of the signal; a terminal that was closed counts as SIGHUP."""

    @property
    def exit_code(self) -> int:
        """128 + the signal's number."""
        return _SIGNAL_EXIT + self.number


class Interruption:
    """The first signal that asked this process to end."""

    def __init__(self) -> None:
        self.number = 0
        """Of the signal; 0 while there is none."""
        self._since = float("-inf")

    def note(self, error: BaseException | None) -> bool:
        """Whether an error, or a signal before it, means the end; a closed terminal is SIGHUP."""
        if isinstance(error, Terminated) and not self.number:
            self.number = error.number
        return bool(self.number) or isinstance(error, KeyboardInterrupt)

    @property
    def exit_code(self) -> int:
        """130 for Ctrl-C, 143 for SIGTERM, 129 for SIGHUP: 128 + the signal's number."""
        return _SIGNAL_EXIT + (self.number or signal.SIGINT)

    @property
    def words(self) -> str:
        """What happened."""
        if self.number in (0, signal.SIGINT):
            return "interrupted"
        return f"ended by {signal.Signals(self.number).name}"

    def take(self, number: int, _frame: FrameType | None) -> None:
        """Handler: raise in the main thread, once; a repetition must not break the stop."""
        now = time.monotonic()
        if self.number and now - self._since < _ENDING:
            return
        self.number, self._since = number, now
        raise KeyboardInterrupt if number == signal.SIGINT else Terminated(number)


@contextmanager
def interrupted_by_signals() -> Iterator[Interruption]:
    """Let signals raise in the main thread for as long as this lasts.

    Signals that are ignored on entry (nohup, a shell's background) stay ignored. Outside the main
    thread nothing is changed.
    """
    got = Interruption()
    before: dict[int, Callable[[int, FrameType | None], object] | int | None] = {}
    if threading.current_thread() is threading.main_thread():
        for name in _NAMES:
            number = getattr(signal, name, None)
            if number is not None and signal.getsignal(number) in _REPLACED:
                before[number] = signal.signal(number, got.take)
    try:
        yield got
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


_REPLACED = (signal.SIG_DFL, signal.default_int_handler)
