"""Jogging by the keys of a terminal: hold to move, or inch by a fixed length a tap."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from enum import Enum
from typing import TYPE_CHECKING, Protocol

import click

from winchkit.bench.control.dead_man import DEAD_MAN, FIRST_PRESS
from winchkit.bench.control.snapshot import Phase
from winchkit.bench.remote.interruption import Terminated
from winchkit.cli.core.terminal import screen, status_line
from winchkit.errors import ConnectionLost, MotionError, WinchkitError, printable

if TYPE_CHECKING:
    from winchkit.bench.direction import DirectionKeyword
    from winchkit.bench.remote.operations import Station

_ARROWS = {"\x1b[A": "up", "\x1b[B": "down", "\x1bOA": "up", "\x1bOB": "down"}
_WINDOWS_ARROWS = {"H": "up", "P": "down"}
_QUEUE = 4096
"""Bytes that a terminal keeps: one reading takes all that waits."""
_POLL = 0.01
"""s, below the repetition of keys (30 ms and more)."""


class Press(Enum):
    """What a key that came is."""

    NEW = "new"
    REPEAT = "repeat"
    IGNORED = "ignored"


class Keys(Protocol):
    """A keyboard."""

    def read(self, timeout: float) -> list[str]:
        """Keys pressed within ``timeout`` s, oldest first; arrows as ``up`` and ``down``."""


class HeldKey:
    """Distinguishes a key that is held, and repeats, from one that was pressed anew.

    A terminal shows no release: the first press holds for longer, since repeats start late, and
    each repeat for as long as a dead-man may. Keys that were typed while this program stood still
    are of no known time: they count as none, and so do the repeats that follow them without a pause
    of the longest delay before the first repeat.
    """

    def __init__(self) -> None:
        self._key = ""
        self._until = float("-inf")
        self._ignored: frozenset[str] = frozenset()

    def press(self, key: str, now: float) -> Press:
        """What a key that came at ``now`` (s) is."""
        going_on = now < self._until
        if going_on and key in self._ignored:
            self._until = now + FIRST_PRESS
            return Press.IGNORED
        repeated = going_on and key == self._key
        self._ignored = frozenset()
        self._key, self._until = key, now + (DEAD_MAN if repeated else FIRST_PRESS)
        return Press.REPEAT if repeated else Press.NEW

    def ignore(self, keys: Collection[str], now: float) -> None:
        """Ignore these keys from ``now`` (s) until they are released."""
        self._ignored, self._until = frozenset(keys), now + FIRST_PRESS


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
            typed = os.read(self._descriptor, _QUEUE).decode(errors="replace")
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


HELP = (
    "hold up: wind in, down: pay out · i: inch 1, 10, 100 mm a tap, then hold again · space: stop"
    " · + −: speed · r: reset · q: stop and quit"
)
INCHES = (0.001, 0.01, 0.1)
"""Steps of the inch mode, m."""
_FASTER = 1.25
"""Factor of the speed at a key press: three presses double it."""
_PICTURE = 0.1
"""s between two pictures of the bench; ten a second look continuous."""
_WIND_IN, _PAY_OUT = "up", "down"
_ARROW_KEYS, _STOPS = (_WIND_IN, _PAY_OUT), (" ", "q")


class KeyboardJog:
    """Actions of the keys. In inch mode a tap is one step, and so is a key that is held."""

    def __init__(self, station: Station, winch: str | None, speed: float) -> None:
        """Begin in hold mode at ``speed`` (m/s, positive)."""
        self._station, self._winch = station, winch
        self._speed = speed
        self._modes: tuple[float | None, ...] = (None, *INCHES)
        self._held = HeldKey()
        self._read = station.clock.now()
        self._told: list[str] = []

    @property
    def inch(self) -> float | None:
        """Length of a tap, m; None in hold mode."""
        return self._modes[0]

    @property
    def mode(self) -> str:
        """The mode and its speed in words."""
        if self.inch is None:
            return f"hold, {self._speed:.3f} m/s"
        return f"{1000 * self.inch:.0f} mm a tap, {self._speed:.3f} m/s"

    def run(self, keys: Keys) -> None:
        """Follow the keys until ``q``, showing where the bench stands."""
        click.echo(HELP, err=True)
        while True:
            try:
                for key in self.current(keys.read(_PICTURE)):
                    if key == "q":
                        self._station.stop()
                        click.echo("\nstopped", err=True)
                        return
                    self.press(key)
                status = self._station.status()
                self._warn(status.get("warnings", []))
                line = printable(status_line(status))
                click.echo(f"\r{line}  [{self.mode}]\x1b[K", nl=False, file=screen())
            except ConnectionLost:
                click.echo("\r\x1b[K", nl=False, file=screen())
                raise
            except OSError:  # the terminal was closed, and shows nothing any more
                raise Terminated from None

    def current(self, keys: list[str]) -> list[str]:
        """Those of the keys just read that are pressed now; several repeats at once are one.

        Where this program stood still for longer than the dead-man only a stop counts.
        """
        before, self._read = self._read, self._station.clock.now()
        if self._read - before <= DEAD_MAN:
            return [
                key
                for key, last in zip(keys, ["", *keys], strict=False)
                if key != last or key not in _ARROW_KEYS
            ]
        if any(key in _ARROW_KEYS for key in keys):
            self._held.ignore(_ARROW_KEYS, self._read)
            click.echo(
                f"\nkeys of the last {self._read - before:.1f} s are ignored: this program stood "
                "still or waited meanwhile; release the key, then press it again",
                err=True,
            )
        return [key for key in keys if key in _STOPS]

    def _warn(self, warnings: list[str]) -> None:
        """Print each new warning, such as a motor that has not turned."""
        for words in warnings:
            if words not in self._told:
                click.echo(f"\n{printable(words)}", err=True)
        self._told = warnings

    def press(self, key: str) -> None:
        """Execute the action of a key; a refusal is shown, and the operator decides."""
        try:
            self._act(key)
        except ConnectionLost:
            raise
        except WinchkitError as error:
            self._held.ignore({key}, self._read)
            click.echo(f"\n{error}", err=True)

    def _act(self, key: str) -> None:
        if key in _ARROW_KEYS:
            self._move(key, self._held.press(key, self._read))
        elif key == "i":
            self._modes = (*self._modes[1:], self._modes[0])
            self._station.release(self._winch)
        elif key in "+-":
            self._speed *= _FASTER if key == "+" else 1 / _FASTER
        elif key == " ":
            self._station.stop()
        elif key == "r":
            self._station.reset()

    def _move(self, key: str, press: Press) -> None:
        """Begin a jog or a step at a new press of an arrow, go on with the jog at a repeat."""
        if press is Press.NEW and self.inch is not None:
            self._step(_directed(key, self.inch))
        elif press is Press.NEW:
            self._station.release(self._winch)
            self._station.jog(
                self._winch, **_directed(key, self._speed), hold=FIRST_PRESS, since=self._read
            )
        elif press is Press.REPEAT and self.inch is None:
            self._station.refresh(self._winch, **_directed(key, self._speed), hold=DEAD_MAN)

    def _step(self, change: DirectionKeyword) -> None:
        """Change the cable length from rest, so that a tap is exactly one step."""
        winches = self._station.status()["winch"]
        name = next(iter(winches)) if self._winch is None else self._winch
        phase = winches.get(name, {}).get("phase", Phase.DISABLED.value)
        if phase != Phase.DISABLED.value:
            raise MotionError(f"winch {name} is still {phase}; this tap was ignored")
        self._station.step(self._winch, **change, speed=self._speed, since=self._read)


def _directed(key: str, value: float) -> DirectionKeyword:
    """A speed or a length in the direction of an arrow."""
    return {"wind_in": value} if key == _WIND_IN else {"pay_out": value}
