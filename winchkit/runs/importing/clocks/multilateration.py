"""Lag of a tracker against the lines of a robot, by linear multilateration.

Differences of the squared cable lengths of a platform that does not turn are linear in its
position. With a cable length that is linear in the motor angle, each coordinate is a linear
function of the motor angles of all lines and of their squares, whatever the frame of the tracker,
the exit points, the drums and the home lengths are. The lag maximises the multiple correlation of
all coordinates with these columns. One line alone follows a coordinate only roughly, and its
correlation with it is largest at a wrong lag.

References
----------
J. J. Caffery, "A new approach to the geometry of TOA location", IEEE VTC Fall 2000, 1943-1949.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from winchkit.arrays import Array
from winchkit.runs.importing.clocks.cross_correlation import (
    LEAST_OVERLAP,
    Agreement,
    Peak,
    TimedSignal,
    agreement_at,
    independent_count,
    interval_of,
    rival_of,
    signals_by_base,
    vertex_of,
)
from winchkit.runs.importing.streams import Streams
from winchkit.schema.mapping import POSITION

_LEAST_LINES = 3
"""Two differences of squared lengths determine a position in a plane."""
_MOST_ROWS = 2000
"""Of the longer file in the search for the lag; the lag is then refined at all samples."""
_RIDGE = 1e-9
"""Of the normal equations with columns of unit variance: angles may be linearly dependent."""


def pose_agreement(first: Streams, second: Streams) -> Agreement | None:
    """Lag of the motor angles of a robot and its positions; None without three lines and these."""
    for lines, tracker in ((first, second), (second, first)):
        angles = signals_by_base(lines).get("motor_angle", [])
        found = signals_by_base(tracker)
        position = [signal for name in POSITION for signal in found.get(name, [])]
        if len(angles) >= _LEAST_LINES and position:
            return _agreement(angles, position, lines_first=lines is first)
    return None


def _agreement(
    angles: Sequence[TimedSignal], position: Sequence[TimedSignal], *, lines_first: bool
) -> Agreement | None:
    interval = max(interval_of(signal) for signal in (*angles, *position))
    spans = [float(np.ptp(signal.time)) for signal in (*angles, *position)]
    step = max(interval, max(spans) / _MOST_ROWS)
    begin, columns = _even_columns(angles, step)
    start, coordinates = _even_columns(position, step)
    x = _with_squares(columns)
    least = max(8 * x.shape[1], int(LEAST_OVERLAP * min(len(x), len(coordinates))))
    lags = np.arange(-(len(coordinates) - 1), len(x))
    lags = lags[np.minimum(len(x), len(coordinates) + lags) - np.maximum(0, lags) >= least]
    if len(lags) < 3:
        return None
    r = np.array([_multiple_correlation(x, coordinates, int(lag)) for lag in lags])
    top = int(np.argmax(r))
    # Of the tracker's clock, to be added for that of the lines.
    lag = begin - start + (float(lags[top]) + vertex_of(r, top)) * step
    a, b = _overlap(x, coordinates, int(lags[top]))
    fitted = a @ _solved(a, b)
    widest = int(np.argmax(np.var(b, axis=0)))
    rest = (b - b.mean(axis=0) - fitted)[:, widest]
    peak = Peak(
        lag if lines_first else -lag,
        float(r[top]),
        rival_of(r, top),
        independent_count(rest),
        len(a) * step,
    )
    pair = _predicted(angles, position[widest], lag), position[widest]
    one, two = pair if lines_first else pair[::-1]
    return agreement_at(peak, one, two, fitted[:, widest], step)


def _even_columns(signals: Sequence[TimedSignal], step: float) -> tuple[float, Array]:
    """Common start of signals, and their samples at even times, shape (n, signals)."""
    start, end = _common_span(signals)
    count = max(0, int((end - start) / step)) + 1
    return start, _columns_at(signals, np.linspace(start, start + step * (count - 1), count))


def _common_span(signals: Sequence[TimedSignal]) -> tuple[float, float]:
    """Times between which all signals have samples, s."""
    starts, ends = ([float(signal.time[n]) for signal in signals] for n in (0, -1))
    return max(starts), min(ends)


def _columns_at(signals: Sequence[TimedSignal], time: Array) -> Array:
    """Signals at given times, shape (n, signals)."""
    return np.stack([np.interp(time, own.time, own.values) for own in signals], axis=1)


def _with_squares(columns: Array) -> Array:
    """Columns and their squares, of mean zero and unit variance."""
    return _of_unit_variance(np.concatenate([columns, columns**2], axis=1))


def _of_unit_variance(columns: Array) -> Array:
    centred = columns - columns.mean(axis=0)
    return np.asarray(centred / np.maximum(np.std(centred, axis=0), 1e-300))


def _overlap(x: Array, y: Array, lag: int) -> tuple[Array, Array]:
    """Rows of both at a lag, y[n] beside x[n + lag]; the columns of x without their means."""
    start, end = max(0, lag), min(len(x), len(y) + lag)
    inside = x[start:end]
    return inside - inside.mean(axis=0), y[start - lag : end - lag]


def _solved(a: Array, b: Array) -> Array:
    gram = a.T @ a + _RIDGE * len(a) * np.eye(a.shape[1])
    return np.asarray(np.linalg.solve(gram, a.T @ (b - b.mean(axis=0))))


def _multiple_correlation(x: Array, y: Array, lag: int) -> float:
    """Square root of the share of the coordinates' variance that the columns explain at a lag."""
    a, b = _overlap(x, y, lag)
    centred = b - b.mean(axis=0)
    total = float(np.sum(centred**2))
    if total == 0:
        return 0.0
    rest = centred - a @ _solved(a, b)
    return math.sqrt(max(0.0, 1 - float(np.sum(rest**2)) / total))


def _predicted(angles: Sequence[TimedSignal], measured: TimedSignal, lag: float) -> TimedSignal:
    """A coordinate by the angles at all of their samples, fitted at a lag."""
    start, end = _common_span(angles)
    time = angles[0].time[(angles[0].time >= start) & (angles[0].time <= end)]
    x = _with_squares(_columns_at(angles, time))
    at = measured.time + lag
    inside = (time >= at[0]) & (time <= at[-1])
    b = np.interp(time[inside], at, measured.values)[:, None]
    centre = x[inside].mean(axis=0)
    values = (x - centre) @ _solved(x[inside] - centre, b)
    return TimedSignal(f"motor angles of {len(angles)} lines", time, values[:, 0] + float(b.mean()))
