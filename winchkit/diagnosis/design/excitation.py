"""Excitation: effects that a set of runs cannot show, as notes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.data.repeats import mean_load
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.residuals.attribution import LEAST_TEMPERATURE_RANGE
from winchkit.model.line import CREEP_SPEED

_LEAST_LOAD_RANGE = 0.05
"""Relative range of loads below which a note says "one load only"; rule of thumb."""
_LEAST_SHARE_OF_DIRECTION = 0.02
"""Share of samples in one direction below which a note says "one direction only"; rule of thumb."""
_SPEED_TOLERANCE = 0.1
"""Relative distance from the median speed that counts as the same speed; rule of thumb."""
_SHARE_AT_ONE_SPEED = 0.75
"""Share of samples at the same speed above which a note says "one speed only"; rule of thumb."""


def missing_excitation(regression: TimeSeriesRegression) -> list[str]:
    """Notes on missing repeats, loads, directions, reversals, speeds and temperatures."""
    dataset = regression.dataset
    notes = []
    if not dataset.repeated:
        notes.append(
            "no run repeats another: the noise is what no known effect explains, so an effect "
            "outside the catalogue cannot be excluded; record one programme twice"
        )
    loads = [m for m in (mean_load(r.signals) for r in dataset.recordings) if m is not None]
    if not loads:
        notes.append("no load and no tension: effects of the cable force cannot be detected")
    elif max(loads) - min(loads) < _LEAST_LOAD_RANGE * max(abs(x) for x in loads):
        notes.append(
            "one load only: cable elasticity and frame compliance, cell gain and offset are hard "
            "to distinguish; repeat a run under another load"
        )
    notes += _motions([r.raw.at.speed for r in dataset.recordings])
    temperatures = [r.signals.temperature for r in dataset.recordings]
    if any(t is None for t in temperatures):
        notes.append("no temperature measured: thermal effects cannot be detected")
    elif (
        np.ptp(np.concatenate([t for t in temperatures if t is not None])) < LEAST_TEMPERATURE_RANGE
    ):
        notes.append(
            "temperature nearly constant: a thermal effect would look like an offset or a wrong "
            "radius; record one run cold and one warm"
        )
    return notes


def _motions(speeds: Sequence[Array]) -> list[str]:
    """Notes on directions, reversals and speeds; ``speeds`` in m/s, one array per run."""
    moving = [speed[np.abs(speed) > CREEP_SPEED] for speed in speeds]
    all_speeds = np.concatenate(moving)
    notes = []
    share_winding_in = float(np.mean(all_speeds > 0)) if len(all_speeds) else 0.0
    if not _LEAST_SHARE_OF_DIRECTION < share_winding_in < 1 - _LEAST_SHARE_OF_DIRECTION:
        notes.append(
            "one direction only: friction and backlash cannot be distinguished from gains and "
            "offsets; run back as well"
        )
    elif not any(np.any(np.diff(np.sign(run))) for run in moving):
        notes.append(
            "no reversals: each run goes one way, so that play, Dahl friction and hysteresis show "
            "at most in how a run begins; turn back within a run"
        )
    magnitude = np.abs(all_speeds)
    if (
        len(magnitude)
        and np.mean(np.abs(magnitude / np.median(magnitude) - 1) < _SPEED_TOLERANCE)
        > _SHARE_AT_ONE_SPEED
    ):
        notes.append(
            "one speed only: dry and viscous friction, play and a late instrument differ in the "
            "ramps alone; run at several speeds"
        )
    return notes
