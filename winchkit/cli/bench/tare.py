"""``winchkit tare``: tares a load cell with its own volatile command."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.options import bench_option, winch_argument
from winchkit.cli.core.output import json_flag, tell

if TYPE_CHECKING:
    from winchkit.schema.bench import BenchSpec

_DURATION = 1.0
"""s, as of `winchkit cell tare`."""


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit tare",
        "winchkit tare A -b bench.toml --json",
    ),
)
@winch_argument
@bench_option
@json_flag("Print the result as JSON.")
def command(winch: str | None, bench: str) -> None:
    """Tare the load cell of WINCH, at rest (the only winch where there is one).

    Subtracts the present reading: by the device's own volatile tare where it has one, which
    `winchkit cell tare --device --clear` takes away, else by the host, which `winchkit cell tare
    --clear` takes away. Nothing is written into its EEPROM.
    """
    from winchkit.bench.remote.session import at_station
    from winchkit.schema.read import read_bench

    spec = read_bench(bench)
    if spec.cells:
        name, tension = _tare_alone(bench, spec, winch)
    else:
        name = spec.winch_named(winch)
        with at_station(spec, client="tare") as station:
            tension = station.tare(name)
    advice = (
        f"  `winchkit cell tare {name} --clear -b {bench}` removes this tare; with --device, "
        "that of the device itself"
    )
    tell({"winch": name, "tension": tension}, [f"tared: the cell reads {tension:.2f} N", advice])


def _tare_alone(bench: str, spec: BenchSpec, winch: str | None) -> tuple[str, float]:
    """Tare a cell of a bench without drives; its winch, and what it reads then (N)."""
    from winchkit.bench.cells.desk import full_name
    from winchkit.bench.cells.instruments import device_of, refs_of
    from winchkit.bench.remote.cell_session import at_cells

    name = full_name(spec, winch)
    place, _, role = name.rpartition(".")
    device = device_of(spec, refs_of(spec)[place, role])
    # A volatile tare of the device, as `winch.tare()` takes it.
    task = "device tare" if device.commands.get("tare") is False else "host tare"
    with at_cells(bench) as cells:
        return place, float(cells.do(task, name, _DURATION)["after"])
