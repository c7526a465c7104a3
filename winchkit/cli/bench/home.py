"""``winchkit home``: lets a drive find its zero, or defines the present cable length."""

from __future__ import annotations

from collections.abc import Sequence

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.options import (
    bench_option,
    dry_run_option,
    effects_option,
    quantity_option,
    take_over_option,
    winch_argument,
)
from winchkit.cli.core.output import json_flag, tell
from winchkit.cli.core.terminal import status_line
from winchkit.errors import UsageError

_POLL = 0.02
"""s, below what a hand or a drive notices."""


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit home A --here '2.5 m'",
        "winchkit home A --method 34 --at '2.4 m' --dry-run",
    ),
)
@winch_argument
@bench_option
@quantity_option(
    "--here", of="length", example="2 m", help="The present cable length; nothing moves."
)
@click.option(
    "--method",
    type=click.IntRange(-128, 127),
    help="Of 6098h: 17, 18 limit switch, 19 to 22 home switch, 33, 34 index; negative: maker's.",
)
@quantity_option(
    "--at", of="length", example="0.5 m", help="With --method: cable length at the zero found."
)
@quantity_option(
    "--speed",
    of="speed",
    example="20 mm/s",
    help="Cable speed.  [default: a tenth of the winch's limit]",
)
@take_over_option
@effects_option
@dry_run_option
@json_flag("Print where it stands as JSON.")
def command(
    winch: str | None,
    *,
    bench: str,
    here: str | None,
    method: int | None,
    at: str | None,
    speed: str | None,
    take_over: bool,
    effects: Sequence[str],
    dry_run: bool,
) -> None:
    """Home WINCH: by a method of its drive, or by the present cable length as you measured it.

    The drive keeps the zero for as long as it is powered, one with an absolute encoder longer; the
    record of positions keeps that of --here where the drive cannot. A search moves the cable by the
    drive's own means; speed, tension and faults are supervised meanwhile, and Ctrl-C stops. Lengths
    are by the winch's profile.
    """
    from winchkit.cli.core.dry_run import station_for
    from winchkit.cli.core.quantities import optional

    if (here is None) == (method is None):
        raise UsageError("no way of homing is given: give either --here LENGTH or --method NUMBER")
    if at is not None and here is not None:
        raise UsageError("--at belongs to --method; --here names the length already")
    length = optional(here if here is not None else at, "length")
    with station_for(
        bench, client="home", dry_run=dry_run, effects=effects, winch=winch
    ) as station:
        if take_over:
            station.take_over(winch)
        station.home(winch, method, length, optional(speed, "speed"))
        while station.homing():
            station.clock.sleep(_POLL)
        status = station.status()
    if not dry_run:
        tell(status, [status_line(status)])
