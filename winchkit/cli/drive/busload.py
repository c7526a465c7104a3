"""``winchkit busload``: the load of a bench file on its CAN buses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.options import bench_argument
from winchkit.cli.core.output import json_flag, tell

if TYPE_CHECKING:
    from winchkit.drivers.can.bus.load import BusLoad


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit busload bench.toml",
        "winchkit busload bench.toml --json",
    ),
)
@bench_argument
@json_flag("Print the loads as JSON.")
@click.pass_context
def command(ctx: click.Context, bench: str) -> None:
    """Worst-case load of each CAN bus of BENCH, and the fastest SYNC that fits.

    Counts every frame with all stuff bits that it may need. Cyclic traffic should take no more
    than 70 % of a bus, the rest is for SDO, emergencies and repeats. Opens nothing. Ends with 1
    when a bus carries more than that.
    """
    from winchkit.bench.drives.calls import bus_load
    from winchkit.drivers.can.bus.load import ADVISED

    found = bus_load(bench)
    lines = (line for name, load in found.items() for line in _lines(name, load))
    tell({"advised": ADVISED, "bus": _trees(found)}, lines)
    ctx.exit(0 if all(load.share <= ADVISED for load in found.values()) else 1)


def _trees(found: dict[str, BusLoad]) -> dict[str, Any]:
    return {
        name: {
            "bitrate": load.bitrate,
            "cycle": load.cycle,
            "share": load.share,
            "fastest_cycle": load.fastest(),
            "frames": [{**vars(frame), "bits": frame.bits} for frame in load.frames],
        }
        for name, load in found.items()
    }


def _lines(name: str, load: BusLoad) -> Iterator[str]:
    fastest = load.fastest()
    yield (
        f"bus {name}: {load.share:.1%} of {load.bitrate / 1000:g} kbit/s at a cycle of "
        f"{load.cycle * 1e3:g} ms ({1 / load.cycle:.0f} Hz); fastest that fits: "
        f"{fastest * 1e3:.1f} ms ({1 / fastest:.0f} Hz)"
    )
    for frame in load.frames:
        when = f"every {_ordinal(frame.every)}" if frame.every else f"every {frame.period:g} s"
        yield f"  {frame.name}: {_bytes(frame.size)}, {frame.bits} bits, {when}"


def _bytes(size: int) -> str:
    return "1 byte" if size == 1 else f"{size} bytes"


def _ordinal(every: int) -> str:
    return "SYNC" if every == 1 else f"{every} SYNCs"
