"""``winchkit cell rate``: how fast an instrument is read, and why not faster."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import click

from winchkit.cli.cell.options import cell_options, cells
from winchkit.cli.core.command import Command
from winchkit.cli.core.output import tell
from winchkit.cli.core.quantity_type import Quantity


@click.command(
    cls=Command,
    examples=(
        "winchkit cell rate",
        "winchkit cell rate A --for 1s",
    ),
)
@cell_options
@click.option(
    "--for",
    "duration",
    type=Quantity("time", example="3 s"),
    default="3 s",
    show_default=True,
    help="Duration of the measurement.",
)
def command(cell: str | None, bench: str, duration: str) -> None:
    """Measure the rate of CELL and say what limits it: wire, turnaround, conversions, sharing."""
    from winchkit.cli.core.quantities import quantity

    seconds = quantity(duration, "time")
    with cells(bench, cell) as (found, name):
        report = found.do("rate", name, seconds)
    tell(report, _lines(report))


def _lines(report: dict[str, Any]) -> Iterator[str]:
    head = f"{report['cell']}: {report['rate']:.1f} readings a second "
    if report["by_itself"]:
        head += f"(its device file says {report['planned']:.1f}); the device sends them by itself"
    else:
        head += f"(planned {report['planned']:.1f}), limited by {report['limited_by']}"
    yield head
    yield from (f"  {rate:8.1f} /s  {what}" for what, rate in report["limits"].items())
    yield from _cost(report["exchange"])
    latency = {key: value * 1e3 for key, value in report["latency"].items()}
    asked = "from its first byte to its last" if report["by_itself"] else "from request to answer"
    yield (
        f"  {asked} p50 {latency['p50']:.2f}, p99 {latency['p99']:.2f}, "
        f"worst {latency['worst']:.2f} ms; {report['duplicates']:.1%} repeat the count before"
    )
    yield "  " + ", ".join(f"{key} {value}" for key, value in report["counters"].items() if value)
    if report["advice"]:
        yield f"  {report['advice']}"


def _cost(cost: dict[str, Any]) -> list[str]:
    """Times of a reading on the line; nothing for a device that sends by itself."""
    if not cost:
        return []
    lines = [f"  a reading keeps the line busy for {cost['time'] * 1e3:.2f} ms"]
    if "bytes" in cost:
        queries = f"{cost['queries']} {'query' if cost['queries'] == 1 else 'queries'}"
        lines[0] += f": {cost['bytes']} bytes in {queries}"
    if cost["baudrate"]:
        lines[0] += f" at {cost['baudrate']} Bd"
    if cost["baudrate"] and "wire" in cost:
        lines.append(
            f"  by the standard {cost['wire'] * 1e3:.2f} ms on the wire, "
            f"{cost['silence'] * 1e3:.2f} ms of silence between frames, "
            f"about {cost['turnaround'] * 1e3:.2f} ms turnaround"
        )
    return lines
