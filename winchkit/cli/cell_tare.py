"""``winchkit cell tare``: a tare of the host, kept beside the wiring file; no EEPROM is written."""

from __future__ import annotations

import click

from winchkit.cli.cell_option import cell_options, cells, host_tare_note, shown, unit_of
from winchkit.cli.output import echo_json

__all__ = ["command"]


@click.command()
@cell_options
@click.option("--for", "duration", default="1 s", show_default=True, help="Averaged over this.")
@click.option("--clear", is_flag=True, help="Take the host's tare away.")
@click.option("--device", is_flag=True, help="Send the device its own volatile tare instead.")
def command(
    cell: str | None, bench: str, duration: str, *, clear: bool, device: bool, as_json: bool
) -> None:
    """Let CELL count from what hangs on it now.

    The host subtracts the mean; the number stands in BENCH.tares.toml and holds for everything
    that opens the bench from now on. The device knows nothing of it.
    """
    from winchkit.cli.duration import quantity

    seconds = quantity(duration, "time")
    with cells(bench, cell) as (found, name):
        if clear:
            result = found.do("clear tare", name)
        else:
            result = found.do("device tare" if device else "host tare", name, seconds)
    unit = unit_of(name)
    if as_json:
        echo_json({"schema": 1, "cell": name, "unit": unit, **result})
        return
    if clear:
        click.echo(f"{name}: the host's tare of {shown(result['removed'], unit)} is gone")
        return
    click.echo(
        f"{name}: tared by {'the device' if device else 'the host'}: "
        f"{shown(result['before'], unit)} ± {shown(result['std'], unit, 2)} is zero now "
        f"({result['readings']} readings); it reads {shown(result['after'], unit)}"
    )
    for line in host_tare_note(result, unit) if device else ():
        click.echo(line)
