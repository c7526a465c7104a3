"""Jogging by the keys of a terminal: hold to move, or inch by a fixed length a tap."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import click

from winchkit.bench.dead_man import FIRST_PRESS
from winchkit.bench.remote.interruption import Terminated
from winchkit.bench.snapshot import Phase
from winchkit.cli.core.terminal import screen
from winchkit.cli.keys import HeldKey
from winchkit.cli.status_line import status_line
from winchkit.errors import ConnectionLost, MotionError, WinchkitError, printable

if TYPE_CHECKING:
    from winchkit.bench.station import Station
    from winchkit.cli.keys import Keys

__all__ = ["HELP", "INCHES", "KeyboardJog"]

HELP = (
    "hold up: wind in, down: pay out · i: inch 1, 10, 100 mm a tap, then hold again · space: stop"
    " · + −: speed · r: reset · q: stop and quit"
)
INCHES = (0.001, 0.01, 0.1)
"""Steps of the inch mode, m."""
_FASTER = 1.25
_PICTURE = 0.1
_WIND_IN, _PAY_OUT = "up", "down"


class KeyboardJog:
    """What each key does. In inch mode a tap is one step, and so is a key that is held."""

    def __init__(
        self, station: Station, winch: str | None, speed: float, now: Callable[[], float]
    ) -> None:
        """Begin in hold mode at ``speed`` (m/s, positive); ``now`` is the time in s."""
        self._station, self._winch = station, winch
        self._speed, self._now = speed, now
        self._modes: tuple[float | None, ...] = (None, *INCHES)
        self._held = HeldKey()

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
                for key in keys.read(_PICTURE):
                    if key == "q":
                        self._station.stop()
                        click.echo("\nstopped", err=True)
                        return
                    self.press(key)
                line = printable(status_line(self._station.status()))
                click.echo(f"\r{line}  [{self.mode}]\x1b[K", nl=False, file=screen())
            except ConnectionLost:
                click.echo("\r\x1b[K", nl=False, file=screen())
                raise
            except OSError:  # the terminal was closed, and shows nothing any more
                raise Terminated from None

    def press(self, key: str) -> None:
        """Do what a key says; what forbids it is shown, and the operator decides."""
        try:
            self._act(key)
        except ConnectionLost:
            raise
        except WinchkitError as error:
            click.echo(f"\n{error}", err=True)

    def _act(self, key: str) -> None:
        if key in (_WIND_IN, _PAY_OUT):
            hold = self._held.hold(key, self._now())
            if self.inch is None:
                speed = self._speed if key == _WIND_IN else -self._speed
                self._station.jog(self._winch, speed, hold)
            elif hold == FIRST_PRESS:
                self._step(-self.inch if key == _WIND_IN else self.inch)
        elif key == "i":
            self._modes = (*self._modes[1:], self._modes[0])
            self._station.jog(self._winch, 0.0, _PICTURE)
        elif key in "+-":
            self._speed *= _FASTER if key == "+" else 1 / _FASTER
        elif key == " ":
            self._station.stop()
        elif key == "r":
            self._station.reset()

    def _step(self, change: float) -> None:
        """Change the cable length from rest, so that a tap is exactly one step."""
        winches = self._station.status()["winch"]
        name = next(iter(winches)) if self._winch is None else self._winch
        phase = winches.get(name, {}).get("phase", Phase.DISABLED.value)
        if phase != Phase.DISABLED.value:
            raise MotionError(f"winch {name} is still {phase}; this tap was ignored")
        self._station.step(self._winch, change, self._speed)
