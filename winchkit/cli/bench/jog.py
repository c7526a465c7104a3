"""``winchkit jog``: moves a winch by hand, for as long as somebody holds on."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import click

from winchkit.cli.bench.direction_option import (
    Directed,
    direction_options,
    magnitude,
    read_direction,
)
from winchkit.cli.bench.holding import hold_on, until_rest
from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.early_checks import check_bench
from winchkit.cli.core.options import (
    bench_option,
    dry_run_option,
    duration_option,
    effects_option,
    quantity_option,
    take_over_option,
    winch_argument,
)
from winchkit.cli.core.output import json_flag, tell
from winchkit.cli.core.terminal import status_line, unknown_length
from winchkit.errors import NotPermitted, UsageError

if TYPE_CHECKING:
    from winchkit.bench.direction import DirectionKeyword
    from winchkit.bench.remote.operations import Station

_SPEED = "0.05 m/s"
_HOW = "--pay-out 0.1m/s --for 2s moves for a time, --wind-in 50mm by a length"


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit jog A --pay-out 0.1m/s --for 0.5s",
        "winchkit jog A --wind-in 50mm -b bench.toml --dry-run",
    ),
)
@winch_argument
@bench_option
@direction_options("SPEED|LENGTH")
@duration_option("With a SPEED: move for this long, then stop.", "2 s")
@quantity_option(
    "--speed",
    of="speed",
    example="0.05 m/s",
    help=f"With keys, or with a LENGTH: how fast; no direction.  [default: {_SPEED}]",
)
@click.option("--reset", is_flag=True, help="First clear trips and drive faults.")
@take_over_option
@effects_option
@dry_run_option
@json_flag("Without keys: print where it stands as JSON.")
def command(
    winch: str | None,
    *,
    bench: str,
    pay_out: str | None,
    wind_in: str | None,
    duration: str | None,
    speed: str | None,
    reset: bool,
    take_over: bool,
    effects: Sequence[str],
    dry_run: bool,
) -> None:
    """Move WINCH (the only one where there is one) by hand.

    --pay-out 0.1m/s --for 2s moves at a speed for a time, --wind-in 50mm by a length. Without
    either, by the keyboard: hold the up arrow to wind in, the down arrow to pay out; releasing it
    stops the winch within 0.2 s (0.7 s after a first short press, since a keyboard repeats late).
    Key i: inch mode, 1, 10 or 100 mm a tap; Space stops, q stops and quits. No emergency stop.
    """
    from winchkit.cli.core.dry_run import station_for

    check_bench(bench)
    asked = _read(pay_out, wind_in, duration, speed)
    if asked.direction is None and (dry_run or not sys.stdin.isatty()):
        raise UsageError(f"there is no terminal to hold a key on: {_HOW}")
    with station_for(bench, client="jog", dry_run=dry_run, effects=effects, winch=winch) as station:
        if reset:
            station.reset()
        if take_over:
            station.take_over(winch)
        if asked.direction is None:
            _jog_by_keys(station, winch, asked.speed)
            return
        if asked.duration is None:
            station.step(winch, **asked.direction.length, speed=asked.speed)
            until_rest(station, winch)
        else:
            _jog_for(station, winch, asked.direction.speed, asked.duration)
        if not dry_run:
            status = station.status()
            tell(status, [status_line(status)])


@dataclass(frozen=True)
class _Asked:
    """Motion that the options request."""

    direction: Directed | None
    """None: by keys."""
    duration: float | None
    """s; None for a length."""
    speed: float
    """Of keys and of a length, m/s."""


def _read(
    pay_out: str | None, wind_in: str | None, duration: str | None, speed: str | None
) -> _Asked:
    """The options in SI; raises UsageError for those that do not belong together."""
    from winchkit.cli.core.quantities import seconds

    direction, limit = read_direction(pay_out, wind_in), seconds(duration)
    if limit is not None:
        if direction is None:
            raise UsageError(
                "no direction is given: --for needs --pay-out SPEED or --wind-in SPEED"
            )
        if speed is not None:
            raise UsageError(f"--speed does not belong to --for: {_HOW}")
        if not limit > 0:
            raise UsageError(f"--for: '{duration}' is no time to move in; write such as '2 s'")
        _ = direction.speed
    elif direction is not None and direction.dimension == "speed":
        raise UsageError(f"no time is given: {direction.option} SPEED needs --for TIME: {_HOW}")
    return _Asked(direction, limit, magnitude("--speed", speed or _SPEED, "speed"))


def _jog_for(station: Station, winch: str | None, speed: DirectionKeyword, duration: float) -> None:
    """Keep a dead-man alive from here for a time."""
    _require_length(station, winch)
    station.jog(winch, **speed)
    hold_on(station, winch, duration)
    station.release(winch)
    until_rest(station, winch)


def _require_length(station: Station, winch: str | None) -> None:
    """Refuse a jog without a held key while the cable length is not known: no limit acts."""
    status = station.status()
    name = next(iter(status["winch"])) if winch is None else winch
    if status["tripped"]:
        return  # which the jog itself says
    if name in status["winch"] and not status["winch"][name]["length_known"]:
        raise NotPermitted(
            f"{unknown_length(status, name)}; until then only a jog by keys that are held is "
            "permitted: `winchkit jog` without --for"
        )


def _jog_by_keys(station: Station, winch: str | None, speed: float) -> None:
    from winchkit.cli.bench.keyboard_jog import KeyboardJog, open_keys

    with open_keys() as keys:
        KeyboardJog(station, winch, speed).run(keys)
