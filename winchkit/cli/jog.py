"""``winchkit jog``: moves a winch by hand, for as long as somebody holds on."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from winchkit.cli.bench_option import (
    bench_option,
    dry_run_option,
    effects_option,
    winch_argument,
)
from winchkit.cli.output import echo_json
from winchkit.cli.status_line import status_line
from winchkit.errors import ConnectionLost, UsageError, WinchkitError

if TYPE_CHECKING:
    from winchkit.bench.station import Station
    from winchkit.cli.keys import HeldKey

__all__ = ["command"]

_REFRESH = 0.05
_HOLD = 0.2
_FASTER = 1.25
_HELP = "hold up: wind in, down: pay out · space: stop · + −: speed · r: reset · q: stop and quit"


@click.command()
@winch_argument
@bench_option
@click.option(
    "--speed",
    default="0.05 m/s",
    show_default=True,
    metavar="SPEED",
    help="Of the rope; positive winds in.",
)
@click.option(
    "--for", "duration", metavar="TIME", help="Without keys: move for this long, then stop."
)
@click.option(
    "--step", metavar="LENGTH", help="Without keys: wind in so much rope (negative pays out)."
)
@click.option("--reset", is_flag=True, help="First clear trips and drive faults.")
@effects_option
@dry_run_option
@click.option(
    "--json", "as_json", is_flag=True, help="Without keys: print where it stands as JSON."
)
def command(
    winch: str | None,
    *,
    bench: str,
    speed: str,
    duration: str | None,
    step: str | None,
    reset: bool,
    effects: Sequence[str],
    dry_run: bool,
    as_json: bool,
) -> None:
    """Move WINCH (the only one where there is one) by hand.

    With the keyboard: hold the up arrow to wind in, the down arrow to pay out; letting go stops
    it within 0.2 s (0.7 s after a first short press, since a keyboard repeats late).
    Space stops, q stops and quits. Attaches to the process that owns the bench where there is
    one. The software is no emergency stop.
    """
    from winchkit.cli.dry_run import station_for
    from winchkit.cli.duration import quantity, seconds

    velocity, limit = quantity(speed, "speed"), seconds(duration)
    if limit is None and step is None and (dry_run or not sys.stdin.isatty()):
        raise UsageError("there is no terminal to hold a key on; use --for TIME or --step LENGTH")
    with station_for(bench, dry_run=dry_run, as_json=as_json, effects=effects) as station:
        if reset:
            station.reset()
        if step is not None:
            station.step(winch, -quantity(step, "length"), abs(velocity))
            _wait(station, winch)
        elif limit is not None:
            _jog_for(station, winch, velocity, limit)
        else:
            _jog_by_keys(station, winch, velocity)
            return
        if as_json and not dry_run:
            echo_json(station.status())
        elif not dry_run:
            click.echo(status_line(station.status()))


def _jog_for(station: Station, winch: str | None, speed: float, duration: float) -> None:
    """Keep a dead-man alive from here for a time."""
    end = time.monotonic() + duration
    while (left := end - time.monotonic()) > 0:
        station.jog(winch, speed, min(_HOLD, left + _REFRESH))
        time.sleep(min(_REFRESH, left))
    station.jog(winch, 0.0, _REFRESH)
    _wait(station, winch)


def _wait(station: Station, winch: str | None) -> None:
    while station.moving(winch):
        time.sleep(_REFRESH)


def _jog_by_keys(station: Station, winch: str | None, speed: float) -> None:
    from winchkit.cli.keys import HeldKey, open_keys

    click.echo(_HELP, err=True)
    speed, held = abs(speed), HeldKey()
    with open_keys() as keys:
        while True:
            for key in keys.read(_REFRESH * 2):
                if key == "q":
                    station.stop()
                    click.echo("\nstopped", err=True)
                    return
                if key in "+-":
                    speed *= _FASTER if key == "+" else 1 / _FASTER
                else:
                    _act(station, winch, key, speed, held)
            click.echo(
                f"\r{status_line(station.status())}  [{speed:.3f} m/s]\x1b[K", nl=False, err=True
            )


def _act(station: Station, winch: str | None, key: str, speed: float, held: HeldKey) -> None:
    """Do what a key says; what forbids it is shown, and the operator decides."""
    try:
        if key in ("up", "down"):
            hold = held.hold(key, time.monotonic())
            station.jog(winch, speed if key == "up" else -speed, hold)
        elif key == " ":
            station.stop()
        elif key == "r":
            station.reset()
    except ConnectionLost:
        raise
    except WinchkitError as error:
        click.echo(f"\n{error}", err=True)
