"""``winchkit cell store``: the one command that lets a device write its EEPROM."""

from __future__ import annotations

import click

from winchkit.cli.cell.options import cell_options, cells
from winchkit.cli.core.command import Command
from winchkit.cli.core.options import yes_option
from winchkit.cli.core.output import tell


@click.command(
    cls=Command,
    examples=(
        "winchkit cell store A -y --command 'store'",
        "winchkit cell store A -b bench.toml -y --json",
    ),
)
@cell_options
@click.option(
    "--command",
    "name",
    default="store",
    show_default=True,
    help="Name of the command in the device file.",
)
@yes_option
def command(cell: str | None, bench: str, name: str, *, yes: bool) -> None:
    """Send CELL a command that writes its EEPROM, such as its own store, or a lasting zero.

    An EEPROM wears out (100,000 writes are usual). Nothing else in winchkit writes it.
    """
    from winchkit.bench.cells.desk import check_permanent

    with cells(bench, cell) as (found, full):
        check_permanent(found.spec, full, name)
        if not yes:
            click.confirm(f"Write the EEPROM of {full} with '{name}'?", abort=True, err=True)
        found.do("store", full, name)
    tell({"cell": full, "command": name}, [f"{full}: '{name}' sent and accepted"])
