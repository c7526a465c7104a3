"""``winchkit cell``: load cells and the other slow instruments of a bench; no drive is touched."""

from __future__ import annotations

import click

from winchkit.cli.core.lazy import CommandPlace, LazyGroup

_READINGS, _ZEROING = "winchkit.cli.cell.readings", "winchkit.cli.cell.zeroing"
COMMANDS = {
    "info": CommandPlace(_READINGS, "What an instrument is, and what it says now.", "info"),
    "rate": CommandPlace(_READINGS, "How fast it can be read, and what limits that.", "rate"),
    "diagnose": CommandPlace(
        "winchkit.cli.cell.diagnose", "Noise, drift, frozen counts, hum, creep."
    ),
    "tare": CommandPlace(_ZEROING, "Count from what hangs on it now, on the host only.", "tare"),
    "zero": CommandPlace(_ZEROING, "Send the device its own zero command.", "zero"),
    "calibrate": CommandPlace(
        "winchkit.cli.cell.calibrate", "Known weights up and down: fit and report."
    ),
    "store": CommandPlace(_ZEROING, "Write the device's EEPROM, on purpose.", "store"),
}


@click.group(
    cls=LazyGroup,
    table=COMMANDS,
    examples=("winchkit cell info", "winchkit cell diagnose --for 2s"),
)
def command() -> None:
    """Load cells: rate, diagnosis, tare, zero and calibration, each independent of the others.

    CELL is a winch, which stands for its load cell, or WINCH.ROLE such as A.load.
    """
