"""Unresolved acceleration: errors where it changes most from one sample to the next.

The acceleration is a difference over the sampling interval, which smooths a corner of the motion.
The error of a weight's force there is as large as the change itself and has no law in any variable,
so that it looks like an unknown effect.
"""

from __future__ import annotations

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.quantity_text import quantity
from winchkit.runs.sanity.finding import Finding
from winchkit.runs.sanity.finding import share as percent

UNRESOLVED = "unresolved-acceleration"
"""Code of the finding."""
_SAMPLES = 0.05
"""Share of the samples in which the acceleration changes most; convention."""
_LEAST_SHARE = 1 / 3
"""Share of the squared error in these samples that is reported: seven times that of an error which
is the same everywhere; rule of thumb."""


def unresolved_acceleration(
    regression: TimeSeriesRegression, residual: Array
) -> tuple[Finding, ...]:
    """Findings on outputs with a third of their squared error where the acceleration changes most,
    for a residual (n_rows,)."""
    recordings, found = regression.dataset.recordings, []
    for output in sorted({"tension", "motor_torque"} & {*regression.outputs}):
        runs = [s.run for s in regression.segments if s.output == output]
        own = [
            (recordings[run].raw.at.motor_acceleration, recordings[run].valid[output])
            for run in runs
        ]
        changes = np.concatenate([_changes(acceleration)[valid] for acceleration, valid in own])
        squares = regression.compared_samples(residual, output) ** 2
        most = changes >= np.quantile(changes, 1 - _SAMPLES)
        share = float(squares[most].sum() / squares.sum()) if squares.any() else 0.0
        if share < _LEAST_SHARE or np.mean(most) > 2 * _SAMPLES:
            continue
        interval = max(float(np.median(np.diff(recordings[run].signals.time))) for run in runs)
        text = (
            f"{percent(share)} of its squared error is in the {percent(_SAMPLES)} of the samples "
            f"where the acceleration changes most: {quantity(interval, 's')} between samples may "
            "not resolve it; record faster, or with gentler ramps"
        )
        found.append(Finding(UNRESOLVED, "", output, share, text))
    return tuple(found)


def _changes(acceleration: Array) -> Array:
    """Larger change to one of the neighbouring samples, (n,)."""
    steps = np.abs(np.diff(acceleration))
    return np.asarray(np.maximum(np.append(steps, 0.0), np.insert(steps, 0, 0.0)))
