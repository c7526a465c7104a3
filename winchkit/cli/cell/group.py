"""``winchkit cell``: load cells and the other slow instruments of a bench; no drive is touched."""

from __future__ import annotations

import click

from winchkit.cli.core.lazy import At, LazyGroup

COMMANDS = {
    "info": At("winchkit.cli.cell.info", "What an instrument is, and what it says now."),
    "rate": At("winchkit.cli.cell.rate", "How fast it can be read, and what limits that."),
    "diagnose": At("winchkit.cli.cell.diagnose", "Noise, drift, frozen counts, hum, creep."),
    "tare": At("winchkit.cli.cell.tare", "Count from what hangs on it now, on the host only."),
    "zero": At("winchkit.cli.cell.zero", "Send the device its own zero command."),
    "calibrate": At("winchkit.cli.cell.calibrate", "Known weights up and down: fit and report."),
    "store": At("winchkit.cli.cell.store", "Write the device's EEPROM, on purpose."),
}


@click.group(
    cls=LazyGroup,
    table=COMMANDS,
    examples=(
        "winchkit cell info",
        "winchkit cell diagnose --for 2s",
    ),
)
def command() -> None:
    """Load cells: rate, diagnosis, tare, zero and calibration, each independent of the others.

    CELL is a winch, which stands for its load cell, or WINCH.ROLE such as A.load.
    """
