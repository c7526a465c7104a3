"""``winchkit cell rate``: how fast an instrument is read, and why not faster."""

from __future__ import annotations

from typing import Any

import click

from winchkit.cli.cell_option import cell_options, cells
from winchkit.cli.output import echo_json

__all__ = ["command"]


@click.command()
@cell_options
@click.option("--for", "duration", default="3 s", show_default=True, help="Measured for this.")
def command(cell: str | None, bench: str, duration: str, *, as_json: bool) -> None:
    """Measure the rate of CELL and say what limits it: wire, turnaround, conversions, sharing."""
    from winchkit.cli.duration import quantity

    seconds = quantity(duration, "time")
    with cells(bench, cell) as (found, name):
        report = found.do("rate", name, seconds)
    if as_json:
        echo_json({"schema": 1, **report})
        return
    for line in _lines(report):
        click.echo(line)


def _lines(report: dict[str, Any]) -> list[str]:
    lines = [
        f"{report['cell']}: {report['rate']:.1f} readings a second "
        f"(planned {report['planned']:.1f}), limited by {report['limited_by']}"
    ]
    lines += [f"  {rate:8.1f} /s  {what}" for what, rate in report["limits"].items()]
    cost = report["exchange"]
    if cost:
        wire = f"{cost['bytes']} bytes in {cost['queries']} "
        wire += "query" if cost["queries"] == 1 else "queries"
        if cost["baudrate"]:
            wire += (
                f", {cost['wire'] * 1e3:.2f} ms at {cost['baudrate']} Bd, "
                f"{cost['silence'] * 1e3:.2f} ms of silence between frames"
            )
        lines.append(f"  a reading is {wire}, about {cost['turnaround'] * 1e3:.2f} ms turnaround")
    latency = {key: value * 1e3 for key, value in report["latency"].items()}
    lines.append(
        f"  from request to answer p50 {latency['p50']:.2f}, p99 {latency['p99']:.2f}, "
        f"worst {latency['worst']:.2f} ms; {report['duplicates']:.1%} repeat the count before"
    )
    lines.append(
        "  " + ", ".join(f"{key} {value}" for key, value in report["counters"].items() if value)
    )
    return [*lines, f"  {report['advice']}"] if report["advice"] else lines
