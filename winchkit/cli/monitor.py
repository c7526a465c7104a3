"""``winchkit monitor``: shows a bench live, or prints it as JSON lines."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from winchkit.cli.bench_option import bench_option
from winchkit.cli.output import echo_json

if TYPE_CHECKING:
    from rich.table import Table

    from winchkit.bench.station import Station

__all__ = ["command", "status_table"]


@click.command()
@bench_option
@click.option("--period", default="0.2 s", show_default=True, help="Between two pictures.")
@click.option("--for", "duration", metavar="TIME", help="End after this time.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object a line.")
def command(*, bench: str, period: str, duration: str | None, as_json: bool) -> None:
    """Show the winches of a bench until Ctrl-C. Moves nothing."""
    from winchkit.bench.session import at_station
    from winchkit.cli.duration import quantity, seconds

    limit, pause = seconds(duration), quantity(period, "time")
    end = None if limit is None else time.monotonic() + limit
    with at_station(bench) as station:
        try:
            _show(station, pause, end, as_json)
        except KeyboardInterrupt:
            click.echo("", err=True)


def _show(station: Station, pause: float, end: float | None, as_json: bool) -> None:
    if as_json:
        while True:
            echo_json(station.status())
            if not _again(pause, end):
                return
    from rich.console import Console
    from rich.live import Live

    with Live(status_table(station.status()), console=Console(stderr=True), screen=False) as live:
        while _again(pause, end):
            live.update(status_table(station.status()))


def _again(pause: float, end: float | None) -> bool:
    """Wait; whether there is time for another picture."""
    left = pause if end is None else end - time.monotonic()
    time.sleep(max(0.0, min(pause, left)))
    return end is None or time.monotonic() < end


def status_table(status: Mapping[str, Any]) -> Table:
    """The winches of a picture, a row each."""
    from rich.table import Table

    buses = status.get("bus", {}).items()
    trouble = dict.fromkeys(
        [
            *status["tripped"],
            *status["blocked"],
            *(f"bus {n}: {t}" for n, b in buses if (t := _lost(b))),
        ]
    )
    table = Table(
        title=f"cycle {status['cycle']}, overruns {status['overruns']}",
        caption="\n".join(trouble) or "no trips",
    )
    table.add_column("winch")
    table.add_column("phase", min_width=len("running down"))
    for head in ("length", "speed", "torque", "tension"):
        table.add_column(head, justify="right", no_wrap=True)
    table.add_column("drive, sensors")
    for name, winch in status["winch"].items():
        table.add_row(
            name,
            winch["phase"],
            _number(winch["cable_length"], 4, "m"),
            _number(winch["speed"], 3, "m/s"),
            _number(winch["motor_torque"], 3, "N m"),
            _number(winch["rope_tension"], 1, "N"),
            ", ".join([winch["state"], *_complaints(winch["quality"] or {})]),
        )
    return table


def _lost(bus: Mapping[str, Any]) -> str:
    """What went wrong on a CAN bus; empty while nothing has."""
    counts = {key: count for key, count in bus.items() if key in _LOSSES and count}
    return ", ".join(f"{key.replace('_', ' ')} {count}" for key, count in counts.items())


def _complaints(quality: dict[str, str]) -> list[str]:
    """Sensors about which there is something to say."""
    return [f"{role} {text}" for role, text in quality.items() if text not in _FINE]


_LOSSES = ("error_frames", "bus_off", "error_passive", "overruns", "dropped", "unsent", "reopened")
_FINE = ("good", "duplicate")


def _number(value: float | None, digits: int, unit: str) -> str:
    return "—" if value is None else f"{value:+.{digits}f} {unit}"
