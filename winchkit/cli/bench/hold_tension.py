"""``winchkit hold-tension``: keeps the tension of a cable while the command runs."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import click

from winchkit.cli.bench.holding import hold_on, until_rest
from winchkit.cli.core.command import Example, ToolCommand
from winchkit.cli.core.options import (
    bench_option,
    dry_run_option,
    duration_option,
    effects_option,
    quantity_option,
    take_over_option,
)
from winchkit.cli.core.output import json_flag, tell
from winchkit.cli.core.quantity_type import QuantityType
from winchkit.cli.core.terminal import status_line
from winchkit.errors import MotionError

_NEEDS_CELL = "needs a bench with a load cell"
_REHEARSED = 1.0
"""Time of a dry run, s."""
_READINGS = 10
"""The newest, of 0.5 s, whose mean is compared with the set tension: one has the cell's noise."""


@click.command(
    cls=ToolCommand,
    examples=(
        Example("winchkit hold-tension A 120N --for 5s", _NEEDS_CELL),
        Example(
            "winchkit hold-tension A 120N --travel 20mm --stiffness '40 kN/m' -b bench.toml",
            _NEEDS_CELL,
        ),
    ),
)
@click.argument("winch", metavar="WINCH")
@click.argument("tension", metavar="TENSION", type=QuantityType("force", example="120 N"))
@bench_option
@duration_option("Stop after this time.  [default: until Ctrl-C]", "5 s")
@quantity_option(
    "--travel",
    of="length",
    default="0.1 m",
    help="Cable either way from its place at the start; the winch trips where it is used up.",
)
@quantity_option(
    "--speed", of="speed", default="20 mm/s", help="Largest speed, without a direction."
)
@quantity_option(
    "--stiffness",
    of="stiffness",
    example="40 kN/m",
    help="Upper bound of cable and structure.  [default: by the profile's cable]",
)
@take_over_option
@effects_option
@dry_run_option
@json_flag("Print where it stands as JSON.")
def command(
    winch: str,
    tension: str,
    *,
    bench: str,
    duration: str | None,
    travel: str,
    speed: str,
    stiffness: str | None,
    take_over: bool,
    effects: Sequence[str],
    dry_run: bool,
) -> None:
    """Keep the tension of WINCH's cable at TENSION (at its platform end, by the load cell).

    The winch moves with a speed proportional to the tension error. It comes to rest within 0.2 s
    of the end of this command, without a fresh reading, and at the declared travel. Exit code 5
    where the tension is more than 1 % from TENSION at the end of --for. A robot's platform:
    `winchkit hold-platform`.
    """
    from winchkit.bench.control.dead_man import DEAD_MAN
    from winchkit.bench.control.tension_control import HELD
    from winchkit.cli.core.dry_run import station_for
    from winchkit.cli.core.quantities import optional, quantity, seconds

    limit = seconds(duration)
    wanted = quantity(tension, "force")
    bounds = {"travel": quantity(travel, "length"), "speed": quantity(speed, "speed")}
    if (bound := optional(stiffness, "stiffness")) is not None:
        bounds["stiffness"] = bound
    with station_for(
        bench,
        client="hold-tension",
        dry_run=dry_run,
        effects=effects,
        winch=winch,
        tension=wanted,
    ) as station:
        if take_over:
            station.take_over(winch)
        station.hold_tension(winch, wanted, DEAD_MAN, bounds)
        shown: deque[float | None] = deque(maxlen=_READINGS)
        hold_on(
            station,
            winch,
            _REHEARSED if dry_run else math.inf if limit is None else limit,
            lambda: shown.append(station.status()["winch"][winch]["load_tension"]),
        )
        station.release(winch)
        until_rest(station, winch)
        status = station.status()
    if dry_run:
        return
    readings = [one for one in shown if one is not None]
    reached = sum(readings) / len(readings) if readings else None
    tell({**status, "set_tension": wanted, "reached": reached}, [status_line(status)])
    if reached is None or abs(wanted - reached) > HELD * wanted:
        held = "without a valid reading" if reached is None else f"{reached:.1f} N"
        raise MotionError(
            f"winch {winch}: {held} at the end of the {limit or 0.0:g} s, set are {wanted:.1f} N "
            f"(limit of the difference {HELD:.0%}, {HELD * wanted:.1f} N); hold it longer, or give "
            "--stiffness: by the bound of the profile a soft cable is slow"
        )
