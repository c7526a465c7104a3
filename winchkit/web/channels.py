"""A channel of runs over their time or over another channel, reduced for drawing."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.plain_json import significant
from winchkit.report.figures.reduction import decimated
from winchkit.runs.run import Run

TIME = "time"
"""In place of a channel: time since the start of the run, s."""
_POINTS = 1600
"""Of all runs together: about one per pixel of a wide plot."""


def lines_of(runs: Iterable[tuple[str, Run]], channel: str, over: str = TIME) -> dict[str, Any]:
    """A channel of each run over another, or over time, for the runs that have both.

    Over time there is the ``difference`` of two runs, the first one interpolated at the instants of
    the second one as far as both last.
    """
    own = [(name, run) for name, run in runs if {channel, over} <= {TIME, *run.channels}]
    difference = _difference(own, channel) if over == TIME and len(own) == 2 else None
    found = [_line(name, run, channel, over) for name, run in own]
    return {"channel": channel, "over": over, "lines": found, "difference": difference}


def _values(run: Run, name: str) -> tuple[str, Array]:
    """Unit and values of a channel, or the time since the start."""
    return ("s", run.time - run.time[0]) if name == TIME else (run.channels[name].unit, run[name])


def _line(name: str, run: Run, channel: str, over: str) -> dict[str, Any]:
    (x_unit, x), (unit, y) = _values(run, over), _values(run, channel)
    return {"x_unit": x_unit, **_reduced(name, unit, x, y, [y] if over == TIME else [x, y])}


def _difference(runs: list[tuple[str, Run]], channel: str) -> dict[str, Any]:
    (first, one), (second, other) = runs
    (_, x1), (_, x2) = _values(one, TIME), _values(other, TIME)
    (unit, y1), (_, y2) = _values(one, channel), _values(other, channel)
    both = x2 <= x1[-1]
    change = y2[both] - np.interp(x2[both], x1, y1)
    return _reduced(f"{second} less {first}", unit, x2[both], change, [change])


def _reduced(name: str, unit: str, x: Array, y: Array, kept: list[Array]) -> dict[str, Any]:
    """A line reduced to the extremes of every pixel of the ``kept`` series."""
    shown = decimated(kept, _POINTS // (2 * len(kept)))
    return {
        "name": name,
        "unit": unit,
        "x": significant(x[shown].tolist(), 6),
        "y": significant(y[shown].tolist(), 5),
    }
