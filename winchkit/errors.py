"""Every error that winchkit raises, in one tree.

    WinchkitError                      exit code
      UsageError                       2  the command or call itself is wrong
      FileError                        3  a file is wrong: every fault of it, with its place
        RunError                       3  a run lacks a column, a unit, a sample
      ConnectionLost (OSError)         4  a bus or a device cannot be reached
        NoReply (TimeoutError)         4  a device did not answer in time
        DeviceRefused                  4  a device answered, and refused
      MotionError                      5  a drive or a limit refuses to move
        DriveFault                     5  the drive reports a fault
        LimitTripped                   5  a supervised limit tripped; latched until reset
        NotPermitted                   5  a safety condition for motion is not met

A message says what, where, the value, the limit, and what to do.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import TypeVar

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")

CONTROL_CHARACTERS = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\xad\u0600-\u0605\u061c\u06dd\u070f\u180e\u200b-\u200f"
    "\u2028-\u202e\u2060-\u206f\ud800-\udfff\ufeff\ufff9-\ufffb\U000e0000-\U000e007f]"
)
"""Control and format characters of Unicode (Cc, Cf, Zl, Zp) and lone surrogates, except line feed
and tab: they control a terminal, or make one text look like another."""
_MOST_SUGGESTIONS = 5
"""Names in a suggestion: one line; more are no help."""


class WinchkitError(Exception):
    """The root of the tree. ``exit_code`` is the exit code of a command for it."""

    exit_code = 1


class UsageError(WinchkitError, ValueError):
    """An invalid call or command line: an unknown name, a value out of range."""

    exit_code = 2


@dataclass(frozen=True)
class Fault:
    """One fault of a file: its place and a description."""

    message: str
    """What is wrong, the value, the limit, and what to do."""
    path: str = ""
    """File."""
    line: int | None = None
    """Line of the file, from 1."""
    key: str = ""
    """Dotted key of a declaration, or column of a run."""

    def __str__(self) -> str:
        place = self.path if self.line is None else f"{self.path}:{self.line}"
        parts = (one_line(place), one_line(self.key), printable(self.message))
        return ": ".join(part for part in parts if part)


class FileError(WinchkitError, ValueError):
    """A file that cannot be used; carries every fault found in it, not only the first.

    Parameters
    ----------
    faults : Fault, sequence of Fault, or str
        Faults of the file; they are the attribute ``faults``, a tuple.
    """

    exit_code = 3

    def __init__(self, faults: Sequence[Fault] | Fault | str) -> None:
        if isinstance(faults, str):
            faults = Fault(faults)
        self.faults: tuple[Fault, ...] = (faults,) if isinstance(faults, Fault) else tuple(faults)
        super().__init__("\n".join(str(fault) for fault in self.faults))


class RunError(FileError):
    """A run that lacks the required data: a missing column, a unit of the wrong dimension."""


class ConnectionLost(WinchkitError, OSError):
    """A bus or device cannot be reached, e.g. an unplugged adapter."""

    exit_code = 4


class NoReply(ConnectionLost, TimeoutError):
    """A device did not answer in time, e.g. a load cell that is switched off."""


class DeviceRefused(ConnectionLost):
    """A device answered and refused, e.g. an SDO abort 06090030h or a Modbus exception."""


class MotionError(WinchkitError, RuntimeError):
    """A motion is refused or was ended."""

    exit_code = 5


class DriveFault(MotionError):
    """The drive reports a fault, e.g. following error 8611h."""


class LimitTripped(MotionError):
    """A supervised limit tripped, e.g. tension above its high limit. Latched until reset."""


class NotPermitted(MotionError):
    """A condition for motion is not met, e.g. no drive-side watchdog."""


def of_each(
    read: Callable[[_Item], _Result], items: Iterable[_Item], kind: type[FileError] = FileError
) -> list[_Result]:
    """``read`` of every item; raises one error of a ``kind`` with the faults of all items."""
    found: list[_Result] = []
    faults: list[Fault] = []
    for item in items:
        try:
            found.append(read(item))
        except FileError as error:
            faults += error.faults
    if faults:
        raise kind(faults)
    return found


def class_name(error: WinchkitError) -> str:
    """Name of the public class of an error, which another process has too."""
    return next(c.__name__ for c in type(error).__mro__ if c.__module__ == __name__)


def error_of(name: str, message: str) -> WinchkitError:
    """An error of another process, by the name of its class and its message."""
    kind = globals().get(name)
    if isinstance(kind, type) and issubclass(kind, WinchkitError):
        return kind(message)
    return WinchkitError(message)


def printable(text: str) -> str:
    """A text with its control characters escaped (``\\x1b``); line feeds and tabs stay."""
    return CONTROL_CHARACTERS.sub(_escaped, text)


def one_line(text: str) -> str:
    """A name or value in one line: line feeds and tabs are escaped as well."""
    return printable(text).replace("\n", "\\n").replace("\t", "\\t")


def _escaped(found: re.Match[str]) -> str:
    return found[0].encode("unicode_escape").decode("ascii")


def some_of(names: Sequence[str], most: int = 30) -> str:
    """Names with commas between them; of more than ``most`` the first, and how many more."""
    left = len(names) - most
    return ", ".join(names[:most]) + (f" and {left} more" if left > 0 else "")


def suggest(word: str, known: list[str]) -> str:
    """``; did you mean 'x'?`` for close names and those that contain the word, else nothing."""
    folded = word.casefold()
    close = [name for name in known if name.casefold() == folded]
    if not close:
        with_part = [name for name in known if folded in re.split(r"[-_./ ]", name.casefold())]
        close = with_part if len(with_part) <= _MOST_SUGGESTIONS else []
    close = close or get_close_matches(word, known, n=1, cutoff=0.6)
    if not close:
        return ""
    *others, last = (f"'{name}'" for name in close)
    return f"; did you mean {', '.join(others)} or {last}?" if others else f"; did you mean {last}?"
