"""``winchkit cell zero``: the device's own zero."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import click

from winchkit.cli.cell.options import cell_options, cells, host_tare_note, shown, unit_of
from winchkit.cli.core.command import Command
from winchkit.cli.core.output import tell
from winchkit.cli.core.quantity_type import Quantity


@click.command(
    cls=Command,
    examples=(
        "winchkit cell zero",
        "winchkit cell zero A -b bench.toml --for 2s",
    ),
)
@cell_options
@click.option(
    "--for",
    "duration",
    type=Quantity("time", example="1 s"),
    default="1 s",
    show_default=True,
    help="Averaging time.",
)
def command(cell: str | None, bench: str, duration: str) -> None:
    """Send the device of CELL its zero command: the present load becomes its gross zero.

    Only a volatile zero is sent; a device that keeps it in its EEPROM needs
    `winchkit cell store --command zero`.
    """
    from winchkit.cli.core.quantities import quantity

    seconds = quantity(duration, "time")
    with cells(bench, cell) as (found, name):
        result = found.do("zero", name, seconds)
    unit = unit_of(name)
    tell({"cell": name, "unit": unit, **result}, _lines(name, result, unit))


def _lines(name: str, result: dict[str, Any], unit: str) -> Iterator[str]:
    yield (
        f"{name}: the device zeroed itself at {shown(result['before'], unit)}; "
        f"it reads {shown(result['after'], unit)}"
    )
    yield from host_tare_note(result, unit)
