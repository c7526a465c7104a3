"""Option ``--device`` of the commands that decode traces of CAN frames."""

from __future__ import annotations

import click

from winchkit.cli.core.completion import complete_file

device_option = click.option(
    "--device",
    "devices",
    multiple=True,
    metavar="[NODE=]DEVICE",
    shell_complete=complete_file,
    help="EDS, DCF or device file of the nodes in a trace of CAN frames, or of one: "
    "'maxon-epos4', '5=cell.eds'. May be given several times.",
)
