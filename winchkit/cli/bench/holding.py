"""Waits of commands that move: refreshing a held motion for a time, and until all is at rest."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from winchkit.bench.remote.operations import Station


def hold_on(
    station: Station,
    winch: str | None,
    duration: float,
    look: Callable[[], object] = lambda: None,
) -> None:
    """Refresh what was started for ``duration`` s, ``look`` each time; MotionError if it ended."""
    from winchkit.bench.control.dead_man import DEAD_MAN, REFRESH

    clock = station.clock
    end = clock.now() + duration
    while (left := end - clock.now()) > 0:
        clock.sleep(min(REFRESH, left))
        station.refresh(winch, hold=DEAD_MAN)
        look()


def until_rest(station: Station, winch: str | None) -> None:
    """Return at the end of a motion; raises what ended it before."""
    from winchkit.bench.control.dead_man import REFRESH

    while station.moving(winch):
        station.clock.sleep(REFRESH)
