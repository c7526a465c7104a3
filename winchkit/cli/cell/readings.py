"""``winchkit cell info`` and ``rate``: what an instrument says now, and how fast it is read."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import click

from winchkit.cli.cell.options import cell_options, cells, shown, unit_of
from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.options import duration_option
from winchkit.cli.core.output import tell


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit cell info",
        "winchkit cell info A -b bench.toml --json",
    ),
)
@cell_options
def info(cell: str | None, bench: str) -> None:
    """Print device file, serial number, calibration, tare, a reading with its times, counters."""
    with cells(bench, cell) as (found, name):
        facts = found.do("about", name)
    tell(facts, _lines_of_info(facts, unit_of(name)))


def _lines_of_info(facts: dict[str, Any], unit: str) -> Iterator[str]:
    device, reading, times = facts["device"], facts["reading"], facts["timing"]
    identity = ", ".join(f"{key} {value:g}" for key, value in facts["identity"].items())
    tare = facts["tare"]
    yield from (
        f"{facts['cell']}: {device['maker']} {device['model']}",
        f"  device file  {device['name']} (trust: {device['trust']}; {device['source']})",
        f"  identity     {identity or 'the device file does not say how to ask'}",
        f"  calibration  {facts['calibration'] or 'none; the values of the device are used'}",
        f"  tare         host {shown(tare['host'], unit)}, device "
        + {True: "on", False: "off", None: "unknown"}[tare["device"]],
        f"  reading      {shown(reading['value'], unit, 6)} net, "
        f"{shown(reading['gross'], unit, 6)} gross, {reading['raw']:g} counts: "
        f"{reading['quality']}",
        f"  sampled      {times['age'] * 1e3:.1f} ± {times['uncertainty'] * 1e3:.1f} ms before "
        f"it was received, of which filter {times['filter'] * 1e3:.1f} ms",
        "  counters     " + ", ".join(f"{key} {value}" for key, value in facts["counters"].items()),
    )
    yield from (f"  ! {remark}" for remark in facts["remarks"])


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit cell rate",
        "winchkit cell rate A --for 1s",
    ),
)
@cell_options
@duration_option("Duration of the measurement.", default="3 s")
def rate(cell: str | None, bench: str, duration: str) -> None:
    """Measure the rate of CELL and say what limits it: wire, turnaround, conversions, sharing."""
    from winchkit.cli.core.quantities import quantity

    seconds = quantity(duration, "time")
    with cells(bench, cell) as (found, name):
        report = found.do("rate", name, seconds)
    tell(report, _lines_of_rate(report))


def _lines_of_rate(report: dict[str, Any]) -> Iterator[str]:
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
