"""The options ``--jsonl`` and ``--udp``: where live pictures go."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from winchkit.bench.live_sinks import LiveSink

__all__ = ["live_sinks"]


@contextmanager
def live_sinks(*, jsonl: bool, udp: str | None) -> Iterator[list[LiveSink]]:
    """The sinks that were asked for; says at the end what could not be sent."""
    from winchkit.bench.live_sinks import JsonLines, UdpJson

    datagrams = None if udp is None else UdpJson(udp, time.time)
    sinks: list[LiveSink] = [JsonLines(sys.stdout)] if jsonl else []
    try:
        yield sinks if datagrams is None else [*sinks, datagrams]
    finally:
        if datagrams is not None:
            datagrams.close()
            if datagrams.dropped:
                click.echo(f"{udp}: {datagrams.dropped} pictures could not be sent", err=True)
