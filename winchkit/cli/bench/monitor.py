"""``winchkit monitor``: shows a bench live, or prints it as JSON lines."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from winchkit.bench.remote.interruption import Terminated
from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.options import bench_option, duration_option, quantity_option
from winchkit.cli.core.output import echo_json, is_json, json_flag
from winchkit.cli.core.terminal import cell, live_table
from winchkit.errors import one_line

if TYPE_CHECKING:
    from rich.console import Group

    from winchkit.bench.remote.operations import Station


@click.command(
    cls=ToolCommand,
    examples=("winchkit monitor --for 2s", "winchkit monitor -b bench.toml --for 1s --json"),
)
@bench_option
@quantity_option("--period", of="time", default="0.2 s", help="Time between two pictures.")
@duration_option("End after this time.")
@json_flag("Print one JSON object a line.")
def command(*, bench: str, period: str, duration: str | None) -> None:
    """Show the winches of a bench until Ctrl-C. Moves nothing.

    Keeps no program from owning the bench; when the owner ends it connects to the next one.
    """
    from winchkit.cli.core.quantities import quantity, seconds

    limit, pause = seconds(duration), quantity(period, "time")
    end = None if limit is None else time.monotonic() + limit
    try:
        (_print_lines if is_json() else _show_table)(bench, pause, end)
    except Terminated:
        raise
    except KeyboardInterrupt:
        click.echo("", err=True)


def _print_lines(bench: str, pause: float, end: float | None) -> None:
    """A picture a line as JSON."""
    from winchkit.bench.remote.session import watch

    def show(station: Station) -> None:
        echo_json(station.status())
        while _again(pause, end):
            echo_json(station.status())

    watch(bench, "monitor", show, lambda words: click.echo(f"winchkit: {words}", err=True))


def _show_table(bench: str, pause: float, end: float | None) -> None:
    """A live table; empty while no process owns the bench."""
    from rich.text import Text

    from winchkit.bench.remote.session import watch

    with live_table(Text("connecting\n"), auto_refresh=True) as live:

        def show(station: Station) -> None:
            live.update(status_table(station.status()), refresh=True)
            while _again(pause, end):
                live.update(status_table(station.status()))

        watch(bench, "monitor", show, lambda words: live.update(Text(words), refresh=True))


def _again(pause: float, end: float | None) -> bool:
    """Wait; whether there is time for another picture."""
    left = pause if end is None else end - time.monotonic()
    time.sleep(max(0.0, min(pause, left)))
    return end is None or time.monotonic() < end


def status_table(status: Mapping[str, Any]) -> Group:
    """The winches of a picture, a row each, and below them what is wrong, in the whole width."""
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    buses = status.get("bus", {}).items()
    trouble = dict.fromkeys(
        [
            *status["tripped"],
            *status["blocked"],
            *filter(None, [status.get("not_commissioned")]),
            *status.get("warnings", ()),
            *(f"bus {n}: {t}" for n, b in buses if (t := _lost(b))),
            *_refused(status),
        ]
    )
    table = Table(
        title=f"cycle {status['cycle']}, overruns {status['overruns']}", padding=0, show_edge=False
    )
    table.add_column("winch")
    table.add_column("phase", min_width=len("running down"))
    for head in ("length", "cable speed", "torque", "tension"):
        table.add_column(head, justify="right", no_wrap=True)
    table.add_column("drive, sensors")
    table.add_column("commanded by", overflow="fold")
    for name, winch in status["winch"].items():
        table.add_row(
            cell(name),
            cell(winch["phase"]),
            _number(winch["cable_length"], 4, "m") if winch["length_known"] else cell("unknown"),
            _number(winch["cable_speed"], 3, "m/s"),
            _number(winch["motor_torque"], 3, "N m"),
            _number(winch["load_tension"], 1, "N"),
            cell(", ".join([winch["state"], *_complaints(winch["quality"] or {})])),
            cell(winch.get("commander") or "—"),
        )
    return Group(table, Text("\n".join(map(one_line, trouble)) or "no trips"))


def _lost(bus: Mapping[str, Any]) -> str:
    """What went wrong on a CAN bus; empty while nothing has."""
    counts = {key: count for key, count in bus.items() if key in _LOSSES and count}
    return ", ".join(f"{key.replace('_', ' ')} {count}" for key, count in counts.items())


def _refused(status: Mapping[str, Any]) -> list[str]:
    """Real-time settings that the owner of the bench does not have."""
    return [
        f"{item['name']}: {item['detail']}; {item['remedy']}"
        for item in status.get("realtime", ())
        if not item["granted"]
    ]


def _complaints(quality: dict[str, str]) -> list[str]:
    """Sensors about which there is something to say."""
    return [f"{role} {text}" for role, text in quality.items() if text not in _FINE]


_LOSSES = ("error_frames", "bus_off", "error_passive", "overruns", "dropped", "unsent", "reopened")
_FINE = ("good", "duplicate")


def _number(value: float | None, digits: int, unit: str) -> str:
    return "—" if value is None else f"{value:+.{digits}f} {unit}"
