"""Where a command works: at the owner of the bench, else as its owner."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from winchkit.bench.client import attach
from winchkit.bench.station import LocalStation, Station
from winchkit.errors import UsageError

__all__ = ["at_station"]


@contextmanager
def at_station(bench_file: str | Path, effects: Sequence[str] = ()) -> Iterator[Station]:
    """A station at the bench: attached to its owner, or owning it for as long as this lasts.

    ``effects`` are files with effects of the user's own, for an owner. Raises FileError,
    ConnectionLost, NotPermitted, UsageError for effects that come too late.
    """
    from winchkit.schema.read import read_bench

    spec = read_bench(bench_file)
    remote = attach(spec)
    if remote is not None:
        try:
            if effects:
                raise UsageError(
                    "another process owns the bench, with its own effects; leave --effects out here"
                )
            yield remote
        finally:
            remote.close()
        return
    from winchkit.bench.bench import open_bench

    with open_bench(spec, effects=effects) as bench:
        station = LocalStation(bench)
        try:
            yield station
        finally:
            station.close()
