"""``winchkit stop``: stops every winch of a bench, now, and never asks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from winchkit.errors import ConnectionLost, MotionError, WinchkitError

if TYPE_CHECKING:
    from winchkit.schema.bench import BenchSpec

__all__ = ["command"]

_PATIENCE = 3.0
"""With the owner, before the bus itself is used, s."""


@click.command()
@click.option("-b", "--bench", required=True, metavar="FILE", help="Wiring file of the bench.")
def command(bench: str) -> None:
    """Quick-stop every winch of a bench and wait until each drive confirms.

    Goes through the process that owns the bench where there is one, else straight to the drives
    on their bus; it never energises anything. Ends with 0 only when every drive has confirmed.
    This is no emergency stop in the sense of EN 60204-1: that one takes the power away.
    """
    from winchkit.bench.client import attach
    from winchkit.schema.read import read_bench

    spec = read_bench(bench)
    try:
        station = attach(spec, patience=_PATIENCE)
        if station is not None:
            station.stop()
            station.close()
            click.echo("stopped: the bench's owner confirms every winch at rest")
            return
    except WinchkitError as error:
        click.echo(f"winchkit: {error}; acting on the bus itself", err=True)
    _stop_on_bus(spec)


def _stop_on_bus(spec: BenchSpec) -> None:
    from winchkit.bench.emergency_stop import stop_on_bus

    results = stop_on_bus(spec)
    for result in results:
        word = "stopped" if result.confirmed else "NOT CONFIRMED"
        click.echo(f"winch {result.winch}: {word}: {result.message}", err=not result.confirmed)
    missing = [result.winch for result in results if not result.confirmed]
    if missing:
        message = f"winch {', '.join(missing)} not confirmed at rest; use the emergency stop"
        reached = any(result.confirmed for result in results)
        raise MotionError(message) if reached else ConnectionLost(message)
