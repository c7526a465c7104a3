"""``winchkit log decode``: CAN frames of a trace in words."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.messages import note
from winchkit.cli.core.options import TABLE, device_option
from winchkit.cli.core.output import echo_json, is_json, json_flag
from winchkit.errors import one_line

if TYPE_CHECKING:
    from winchkit.can_trace import TraceFrame
    from winchkit.drivers.can.tools.decode import DecodedFrame

_KINDS = ("NMT", "SYNC", "EMCY", "TPDO", "RPDO", "SDO", "heartbeat", "LSS", "other")


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit log decode candump.log --device maxon-epos4",
        "winchkit log decode bus.trc --device 1=drive.eds --device 9=generic-cia404 --only SDO",
    ),
)
@click.argument("file", metavar="FILE", type=TABLE)
@device_option
@click.option(
    "--only",
    "kinds",
    multiple=True,
    type=click.Choice(_KINDS, case_sensitive=False),
    help="Print frames of this kind only; may be given several times.",
)
@json_flag("Print all frames as JSON.")
def command(*, file: str, devices: Sequence[str], kinds: Sequence[str]) -> None:
    """Print the CAN frames of FILE in words: NMT, heartbeats, EMCY, SDO transfers, aborts, PDOs.

    FILE is a trace of candump (all three forms), PCAN (.trc), Vector (.asc, .blf), or a CSV table
    of frames. PDOs have the mapping of the EDS or device file, until SDO writes in FILE change it;
    without --device they are bytes.
    """
    from winchkit.drivers.can.tools.decoded_trace import decode_trace

    trace = decode_trace(file, devices)
    shown = [pair for pair in trace.frames if not kinds or pair[1].kind in kinds]
    if is_json():
        frames = [_entry(frame, words) for frame, words in shown]
        echo_json(
            {
                "schema": 1,
                "file": file,
                "layout": trace.layout,
                "notes": trace.notes,
                "frames": frames,
            }
        )
        return
    has_buses = len({bus for bus, _ in trace.nodes}) > 1
    for frame, words in shown:
        click.echo(_line(frame, words, has_buses=has_buses))
    for text in trace.notes:
        click.echo(f"{one_line(file)}: {one_line(text)} (warning)", err=True)
    counts = Counter(words.kind for _, words in trace.frames)
    note(
        f"{trace.layout}: " + ", ".join(f"{counts[kind]} {kind}" for kind in _KINDS if counts[kind])
    )


def _line(frame: TraceFrame, words: DecodedFrame, *, has_buses: bool) -> str:
    time = f"line {frame.line:>7}" if math.isnan(frame.time) else f"{frame.time:12.6f}"
    bus = f"{frame.bus} " if has_buses else ""
    return f"{time}  {one_line(bus)}{frame.identifier:03X}  {words.kind:9}  {one_line(words.text)}"


def _entry(frame: TraceFrame, words: DecodedFrame) -> dict[str, object]:
    return {
        "line": frame.line,
        "time": None if math.isnan(frame.time) else frame.time,
        "bus": frame.bus,
        "id": frame.identifier,
        "data": frame.data.hex(),
        **vars(words),
    }
