"""``winchkit cell tare``, ``zero`` and ``store``: the zero of a cell on the host and in the device.

A tare of the host is kept beside the bench file; only ``store`` lets a device write its EEPROM.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import click

from winchkit.cli.cell.options import cell_options, cells, host_tare_note, shown, unit_of
from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.options import duration_option, yes_option
from winchkit.cli.core.output import tell

_TASKS = {
    (False, False): "host tare",
    (False, True): "device tare",
    (True, False): "clear tare",
    (True, True): "clear device tare",
}
"""By --clear and --device."""


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit cell tare",
        "winchkit cell tare A --clear",
    ),
)
@cell_options
@duration_option("Averaging time.", default="1 s")
@click.option("--clear", is_flag=True, help="Take the tare away: the host's, or with --device its.")
@click.option("--device", is_flag=True, help="Send the device its own volatile tare instead.")
def tare(cell: str | None, bench: str, duration: str, *, clear: bool, device: bool) -> None:
    """Let CELL count from what hangs on it now.

    The host subtracts the mean; the number stands in BENCH.tares.toml and holds for everything
    that opens the bench from now on. The device knows nothing of it.

    `winchkit tare` does this where the device has no volatile tare of its own, else what --device
    does: --clear takes the first away, --device --clear the second.
    """
    from winchkit.cli.core.quantities import quantity

    seconds = quantity(duration, "time")
    with cells(bench, cell) as (found, name):
        task = _TASKS[clear, device]
        result = found.do(task, name, *() if task == "clear tare" else (seconds,))
    unit = unit_of(name)
    tell({"cell": name, "unit": unit, **result}, _lines_of_tare(name, task, result, unit))


def _lines_of_tare(name: str, task: str, result: dict[str, Any], unit: str) -> Iterator[str]:
    yield f"{name}: {_told(task, result, unit)}"
    if "device" in task:
        yield from host_tare_note(result, unit)


def _told(task: str, result: dict[str, Any], unit: str) -> str:
    """The tare in words."""
    if task == "clear tare":
        return (
            f"the host's tare of {shown(result['removed'], unit)} is gone; "
            "`winchkit tare` sets one again"
        )
    before, after = (shown(result[key], unit) for key in ("before", "after"))
    if task == "clear device tare":
        return (
            f"the device's own tare is gone: it read {before}; it reads {after}; "
            "`winchkit tare` sets one again"
        )
    by = "the device" if task == "device tare" else "the host"
    return (
        f"tared by {by}: {before} ± {shown(result['std'], unit, 2)} is zero now "
        f"({result['readings']} readings); it reads {after}"
    )


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit cell zero",
        "winchkit cell zero A -b bench.toml --for 2s",
    ),
)
@cell_options
@duration_option("Averaging time.", default="1 s")
def zero(cell: str | None, bench: str, duration: str) -> None:
    """Send the device of CELL its zero command: the present load becomes its gross zero.

    Only a volatile zero is sent; a device that keeps it in its EEPROM needs
    `winchkit cell store --command zero`.
    """
    from winchkit.cli.core.quantities import quantity

    seconds = quantity(duration, "time")
    with cells(bench, cell) as (found, name):
        result = found.do("zero", name, seconds)
    unit = unit_of(name)
    tell({"cell": name, "unit": unit, **result}, _lines_of_zero(name, result, unit))


def _lines_of_zero(name: str, result: dict[str, Any], unit: str) -> Iterator[str]:
    yield (
        f"{name}: the device zeroed itself at {shown(result['before'], unit)}; "
        f"it reads {shown(result['after'], unit)}"
    )
    yield from host_tare_note(result, unit)


@click.command(
    cls=ToolCommand,
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
def store(cell: str | None, bench: str, name: str, *, yes: bool) -> None:
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
