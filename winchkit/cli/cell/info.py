"""``winchkit cell info``: identity, present reading and status of an instrument."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import click

from winchkit.cli.cell.options import cell_options, cells, shown, unit_of
from winchkit.cli.core.command import Command
from winchkit.cli.core.output import tell


@click.command(
    cls=Command,
    examples=(
        "winchkit cell info",
        "winchkit cell info A -b bench.toml --json",
    ),
)
@cell_options
def command(cell: str | None, bench: str) -> None:
    """Print device file, serial number, calibration, tare, a reading with its times, counters."""
    with cells(bench, cell) as (found, name):
        facts = found.do("about", name)
    tell(facts, _lines(facts, unit_of(name)))


def _lines(facts: dict[str, Any], unit: str) -> Iterator[str]:
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
