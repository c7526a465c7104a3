"""``winchkit log replay``: plays a log as if it came from the bench."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.messages import note
from winchkit.cli.core.options import RUN

if TYPE_CHECKING:
    from winchkit.bench.control.snapshot import BenchSnapshot
    from winchkit.bench.recording.live_sinks import LiveSink

_SHOW_PERIOD = 0.1
"""s between two pictures; ten a second look continuous."""


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit log replay lift.mcap --fast",
        "winchkit log replay lift.mcap --fast --jsonl",
    ),
)
@click.argument("file", metavar="FILE", type=RUN)
@click.option("--fast", is_flag=True, help="As fast as it can be shown, not at the log's pace.")
@click.option("--jsonl", is_flag=True, help="Print every picture to stdout, one JSON a line.")
@click.option("--udp", metavar="HOST:PORT", help="Send every picture as JSON, e.g. to PlotJuggler.")
def command(*, file: str, fast: bool, jsonl: bool, udp: str | None) -> None:
    """Play FILE (.mcap or .csv): a live table, JSON lines, or UDP, as `winchkit log` gives them."""
    from winchkit.bench.recording.replay import open_replay
    from winchkit.cli.core.terminal import live_sinks

    replay = open_replay(file)
    with live_sinks(jsonl=jsonl, udp=udp) as asked, _table_unless(asked) as sinks:
        replay.on_cycle(partial(_show, sinks))
        count = replay.play(fast=fast)
    note(f"{file}: {count} pictures")


def _show(sinks: Sequence[LiveSink], snapshot: BenchSnapshot) -> None:
    from winchkit.bench.control.snapshot import to_dict

    status = to_dict(snapshot)
    for sink in sinks:
        sink(status)


@contextmanager
def _table_unless(asked: list[LiveSink]) -> Iterator[list[LiveSink]]:
    """The sinks that were asked for, or a live table."""
    if asked:
        yield asked
        return
    from winchkit.cli.bench.monitor import status_table
    from winchkit.cli.core.terminal import live_table

    shown, last = 0.0, None
    with live_table() as live:

        def show(status: Mapping[str, Any]) -> None:
            nonlocal shown, last
            last = status
            if time.monotonic() - shown >= _SHOW_PERIOD:
                shown = time.monotonic()
                live.update(status_table(status), refresh=True)

        yield [show]
        if last is not None:
            live.update(status_table(last), refresh=True)
