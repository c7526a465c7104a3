"""``winchkit stop`` and ``winchkit reset``: stops every winch of a bench, and clears its trips."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.options import bench_option, dry_run_option
from winchkit.cli.core.output import echo_json, is_json, json_flag, tell
from winchkit.errors import ConnectionLost, MotionError, WinchkitError

if TYPE_CHECKING:
    from winchkit.bench.emergency_stop import Stopped
    from winchkit.schema.bench import BenchSpec

_TIMEOUT = 3.0
"""With the owner, before the bus itself is used, s."""
_CLOSING = 0.5
"""For an owner that ends, s: it stops its drives within 0.2 s; one that hangs delays no longer."""
_BY_OWNER = "the bench's owner confirms it at rest"


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit stop",
        "winchkit stop -b bench.toml --dry-run",
    ),
)
@bench_option
@dry_run_option
@json_flag("Print who has confirmed as JSON.")
def command(bench: str, *, dry_run: bool) -> None:
    """Quick-stop every winch of a bench and wait until each drive confirms.

    Goes through the process that owns the bench where there is one, else straight to the drives
    on their bus; it never energises anything. A command that is still opening the bench moves
    nothing and ends with 5. Ends with 0 only when every drive has confirmed. This is no emergency
    stop in the sense of EN 60204-1: that one takes the power away.
    """
    from winchkit.bench.emergency_stop import Stopped
    from winchkit.bench.ownership import await_end, mark_stop
    from winchkit.bench.remote.client import attach
    from winchkit.bench.remote.identity import client_name
    from winchkit.schema.read import read_bench

    spec = read_bench(bench)
    if dry_run:
        _show(spec)
        return
    mark_stop(spec)
    try:
        station = attach(spec, timeout=_TIMEOUT, name=client_name("stop"))
        if station is not None:
            station.stop()
            station.close()
            _tell([Stopped(name, True, _BY_OWNER) for name in spec.winch])
            return
    except WinchkitError as error:
        # An owner that has the stop, and is closing the bench, would take the frames for those of
        # a second master, and latch that.
        await_end(spec, _CLOSING)
        click.echo(f"winchkit: {error}; acting on the bus itself", err=True)
    _stop_on_bus(spec)


def _show(spec: BenchSpec) -> None:
    """Frames to the drives themselves where no process owns the bench."""
    from winchkit.cli.core.dry_run import nodes_of, show_frames, writes
    from winchkit.drivers.can.cia402.state_machine import QUICK_STOP

    word = QUICK_STOP.to_bytes(2, "little")
    servos = [winch.servo for winch in spec.winch.values()]
    frames = [
        frame for ref in servos for frame in writes(ref.bus, ref.node or 1, [(0x6040, 0, word)])
    ]
    show_frames(frames, nodes_of(spec))


def _stop_on_bus(spec: BenchSpec) -> None:
    from winchkit.bench.emergency_stop import stop_on_bus

    results = stop_on_bus(spec)
    _tell(results)
    missing = [result.winch for result in results if not result.confirmed]
    if missing:
        message = f"winch {', '.join(missing)} not confirmed at rest; use the emergency stop"
        reached = any(result.confirmed for result in results)
        raise MotionError(message) if reached else ConnectionLost(message)


def _tell(results: Sequence[Stopped]) -> None:
    if is_json():
        echo_json({"schema": 1, "stopped": list(results)})
        return
    for result in results:
        word = "stopped" if result.confirmed else "NOT CONFIRMED"
        click.echo(f"winch {result.winch}: {word}: {result.message}", err=not result.confirmed)


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit reset",
        "winchkit reset -b bench.toml --json",
    ),
)
@bench_option
@dry_run_option
@json_flag("Print the bench's state, and what was cleared, as JSON.")
def reset(bench: str, *, dry_run: bool) -> None:
    """Clear latched trips and drive faults of a bench; every winch stays disabled.

    Drives that restarted are set up again. Ends with 5, naming why, where something still
    forbids motion. Attaches to the process that owns the bench where there is one.
    """
    from winchkit.cli.core.dry_run import station_for

    with station_for(bench, client="reset", dry_run=dry_run) as station:
        cleared = station.reset()
        status = station.status()
    if dry_run:
        return
    lines = [f"cleared: {item}" for item in cleared]
    lines += ["reset: nothing is tripped" if cleared else "reset: there was nothing to clear"]
    lines += [f"still forbidden: {trip}" for trip in status["blocked"]]
    tell({**status, "cleared": cleared}, lines)
