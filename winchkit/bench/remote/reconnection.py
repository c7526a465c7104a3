"""Watching a bench beyond its owner: connects again when the owner has ended or handed over."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from winchkit.bench.remote.requests import OwnerGone
from winchkit.bench.remote.session import at_station

if TYPE_CHECKING:
    from winchkit.bench.remote.station import Station

_GRACE = 0.5
"""For a program that takes the bench over, before a bench process is started, s."""
_Result = TypeVar("_Result")


def watch(
    bench_file: str | Path,
    client: str,
    use: Callable[[Station], _Result],
    lost: Callable[[str], None],
    effects: Sequence[str] = (),
) -> _Result:
    """Call ``use`` with a station that only looks on, and again with a new one after each loss.

    ``lost`` is called with a text when an owner has gone. Returns what ``use`` returns. Raises the
    errors of ``at_station`` where the bench cannot be reached any more.
    """
    while True:
        try:
            with at_station(bench_file, effects, client=client, observer=True) as station:
                return use(station)
        except OwnerGone as error:
            lost(f"{error}; connecting again")
            time.sleep(_GRACE)
